//! The listing of the public interface, so that every change of it is seen in review.
//!
//! The listing is read off the sources, which `rustfmt` keeps regular: items at the margin, members
//! four spaces in, following `pub mod` from the crate's root. Stable Rust is all it needs. To write
//! it anew: `ERRSEP_WRITE_API=1 cargo test -p errsep-solvers --test public_interface`.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

fn listing_file() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/api/errsep-solvers.txt")
}

/// A public module: its path in Rust and its lines, without tests.
struct Module {
    path: String,
    lines: Vec<String>,
}

/// The public modules from a file on, in alphabetical order of their paths.
fn modules(file: &Path, path: &str, found: &mut Vec<Module>) {
    let text = fs::read_to_string(file).expect("a source file");
    let lines: Vec<String> = text
        .lines()
        .take_while(|line| *line != "#[cfg(test)]")
        .map(str::to_string)
        .collect();
    let stem = file.file_stem().and_then(|s| s.to_str()).expect("a name");
    let folder = match stem {
        "lib" | "mod" => file.with_file_name(""),
        _ => file.with_extension(""),
    };
    // A private module counts when its items are exported beside it.
    let exported = |name: &str| {
        lines
            .iter()
            .any(|l| l.starts_with(&format!("pub use {name}::")))
    };
    let children = lines.iter().filter_map(|line| {
        let private = line.strip_prefix("mod ").and_then(|l| l.strip_suffix(';'));
        let public = line
            .strip_prefix("pub mod ")
            .and_then(|l| l.strip_suffix(';'));
        public.or(private.filter(|name| exported(name)))
    });
    for name in children {
        let beside = folder.join(format!("{name}.rs"));
        let within = folder.join(name).join("mod.rs");
        let child = if beside.exists() { beside } else { within };
        modules(&child, &format!("{path}::{name}"), found);
    }
    let path = path.to_string();
    found.push(Module { path, lines });
}

/// The header that begins at a line, up to its body, on one line.
fn header(lines: &[String], from: usize) -> String {
    let mut words: Vec<&str> = Vec::new();
    for line in &lines[from..] {
        let line = line.trim();
        words.push(line);
        if line.ends_with('{') || line.ends_with(';') || line.ends_with("{}") {
            break;
        }
    }
    let joined = words.join(" ");
    let without_body = joined
        .trim_end_matches("{}")
        .trim_end_matches('{')
        .trim_end();
    let tidy = without_body.replace("( ", "(").replace(", )", ")");
    match tidy.split_once(" = ") {
        Some((name, _)) if name.starts_with("pub const") => format!("{name};"),
        _ => tidy,
    }
}

/// The name of the type that an `impl` header is for.
fn implementing_type(header: &str) -> &str {
    let subject = header.rsplit(" for ").next().unwrap_or(header);
    let subject = match subject.strip_prefix("impl<") {
        Some(rest) => rest.split_once("> ").map_or(rest, |(_, name)| name),
        None => subject.strip_prefix("impl ").unwrap_or(subject),
    };
    subject.split(['<', ' ']).next().unwrap_or(subject)
}

fn public_types(modules: &[Module]) -> BTreeSet<String> {
    let kinds = ["pub struct ", "pub enum ", "pub trait ", "pub union "];
    let lines = modules.iter().flat_map(|module| &module.lines);
    lines
        .filter_map(|line| kinds.iter().find_map(|kind| line.strip_prefix(kind)))
        .map(|rest| {
            rest.split(['<', ' ', '(', ';', ':'])
                .next()
                .unwrap_or(rest)
                .to_string()
        })
        .collect()
}

/// What the body of an item shows of its members.
#[derive(Clone, Copy, PartialEq)]
enum Body {
    Fields,
    Variants,
    Methods,
    PublicMethods,
    Hidden,
}

fn list(module: &Module, public: &BTreeSet<String>, out: &mut String) {
    out.push_str(&format!("\nmod {}\n", module.path));
    let mut body = Body::Hidden;
    for (at, line) in module.lines.iter().enumerate() {
        let member = line
            .strip_prefix("    ")
            .filter(|rest| !rest.starts_with(' '));
        let field = line
            .strip_prefix("        ")
            .filter(|rest| !rest.starts_with(' '));
        if !line.starts_with([' ', '}', '/', '#', ')']) && !line.is_empty() {
            let header = header(&module.lines, at);
            let (shown, next) = if line.starts_with("pub(") {
                (false, Body::Hidden)
            } else if line.starts_with("pub enum") {
                (true, Body::Variants)
            } else if line.starts_with("pub trait") {
                (true, Body::Methods)
            } else if line.starts_with("pub struct") {
                (true, Body::Fields)
            } else if line.starts_with("pub ") {
                (true, Body::Hidden)
            } else if line.starts_with("impl") && public.contains(implementing_type(&header)) {
                let of_trait = header.contains(" for ");
                (
                    true,
                    if of_trait {
                        Body::Hidden
                    } else {
                        Body::PublicMethods
                    },
                )
            } else {
                (false, Body::Hidden)
            };
            body = next;
            if shown {
                out.push_str(&format!("  {header}\n"));
            }
        } else if let Some(member) = member {
            let is_public = member.starts_with("pub ");
            let is_method = member.starts_with("fn ") || member.starts_with("type ");
            let is_variant = member.starts_with(|c: char| c.is_ascii_uppercase());
            let shown = match body {
                Body::Fields | Body::PublicMethods => is_public,
                Body::Methods => is_method,
                Body::Variants => is_variant,
                Body::Hidden => false,
            };
            if shown && body == Body::Fields {
                out.push_str(&format!("    {}\n", member.trim_end_matches(',')));
            } else if shown && body == Body::Variants {
                out.push_str(&format!(
                    "    {}\n",
                    member.trim_end_matches([',', '{', ' '])
                ));
            } else if shown {
                out.push_str(&format!("    {}\n", header(&module.lines, at)));
            }
        } else if let (Body::Variants, Some(field)) = (body, field)
            && field.starts_with(|c: char| c.is_ascii_lowercase())
        {
            out.push_str(&format!("      {}\n", field.trim_end_matches(',')));
        }
    }
}

fn listing() -> String {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/lib.rs");
    let mut found = Vec::new();
    modules(&root, "errsep_solvers", &mut found);
    found.sort_by(|a, b| a.path.cmp(&b.path));
    let public = public_types(&found);
    let mut out = String::from(
        "The public interface of errsep-solvers, written by solvers/tests/public_interface.rs.\n",
    );
    for module in &found {
        list(module, &public, &mut out);
    }
    out
}

#[test]
fn listing_is_up_to_date() {
    let now = listing();
    let file = listing_file();
    if std::env::var_os("ERRSEP_WRITE_API").is_some() {
        fs::create_dir_all(file.parent().expect("a folder")).expect("writable");
        fs::write(&file, &now).expect("writable");
    }
    let written = fs::read_to_string(&file).unwrap_or_default();
    let (now, written): (BTreeSet<&str>, BTreeSet<&str>) =
        (now.lines().collect(), written.lines().collect());
    let added: Vec<_> = now.difference(&written).collect();
    let gone: Vec<_> = written.difference(&now).collect();
    assert!(
        added.is_empty() && gone.is_empty(),
        "the public interface has changed; if on purpose, write {} anew with ERRSEP_WRITE_API=1\n\
         added: {added:#?}\ngone: {gone:#?}",
        file.display()
    );
}

#[test]
fn listing_sees_what_matters() {
    let listing = listing();
    for line in [
        "mod errsep_solvers::outcome",
        "  pub trait Problem",
        "    fn jacobian(&self, parameters: &DVector<f64>) -> Result<DMatrix<f64>, NoValue>;",
        "    NotIdentifiable",
        "      combinations: Vec<Combination>",
        "    pub fn covariance(&self) -> Covariance",
        "    pub max_iterations: u64",
        "  pub fn fit<P: Problem + ?Sized>(problem: &P, start: DVector<f64>, options: &Options) -> Result<Fit, FitError>",
    ] {
        assert!(listing.lines().any(|l| l == line), "{line}");
    }
    // of modules that are not public, and not of public modules' private parts
    assert!(!listing.contains("free_parameters"));
    assert!(!listing.contains("CURVATURE_FLOOR"));
}
