//! The rooms of the diagnosis know only what stands before them.

use std::path::Path;

/// In the order in which they work; what is on one level may not know each other either.
const ORDER: [&[&str]; 11] = [
    &["search", "options", "levels"],
    &["noise"],
    &["detection"],
    &["attribution"],
    &["planning"],
    &["severity"],
    &["verdict", "catalogue"],
    &["diagnose"],
    &["joined", "agreement", "learning", "symbolic"],
    &["sealing"],
    &["questions"],
];

fn level(room: &str) -> Option<usize> {
    ORDER.iter().position(|rooms| rooms.contains(&room))
}

/// Every `crate::…` path of the diagnosis's files, with the file's room.
fn paths() -> Vec<(String, String)> {
    let home = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut found = Vec::new();
    for entry in std::fs::read_dir(home).unwrap() {
        let path = entry.unwrap().path();
        let room = path.file_stem().unwrap().to_str().unwrap().to_owned();
        let files: Vec<_> = if path.is_dir() {
            let inside = std::fs::read_dir(&path).unwrap();
            inside.map(|file| file.unwrap().path()).collect()
        } else {
            vec![path]
        };
        for file in files {
            let text = std::fs::read_to_string(&file).unwrap();
            let code = text.split("#[cfg(test)]").next().unwrap_or_default();
            for part in code.split("crate::").skip(1) {
                let end = part.find(|c: char| !c.is_alphanumeric() && !"_:".contains(c));
                found.push((room.clone(), part[..end.unwrap_or(part.len())].to_owned()));
            }
        }
    }
    found
}

#[test]
fn rooms_know_only_what_stands_before_them() {
    let paths = paths();
    assert!(
        paths.len() > 50,
        "{} paths: are the files read?",
        paths.len()
    );
    for (room, path) in paths {
        let parts: Vec<&str> = path.split("::").collect();
        // `lib.rs` is the whole.
        if room == "lib" {
            continue;
        }
        let own = level(&room).unwrap_or_else(|| panic!("{room} has no place in the order"));
        match parts.as_slice() {
            [other, ..] if level(other).is_some() => {
                let before = level(other) < Some(own) || *other == room;
                assert!(before, "{room} knows {path}");
            }
            _ => panic!("{room} knows {path}, which is no room below it"),
        }
    }
}
