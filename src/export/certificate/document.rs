//! The certificate as a document.

use super::admin::{Admin, Certificate, Contact, Date, Person, Text, Thing};
use super::numbers::{Entry, Group, Numbers, Uncertainty};
use super::si;
use super::xml::Node;
use crate::io::Message;

/// Version of the schema.
const VERSION: &str = "3.2.1";

/// The whole certificate.
///
/// # Errors
/// A number whose unit has no name in D-SI.
pub fn document(numbers: &Numbers, admin: &Admin) -> Result<Node, Message> {
    let results = Node::with("dcc:measurementResults", [measurement(numbers, admin)?]);
    let location = format!("https://ptb.de/dcc https://ptb.de/dcc/v{VERSION}/dcc.xsd");
    Ok(Node::with(
        "dcc:digitalCalibrationCertificate",
        [administrative(admin), results],
    )
    .attribute("xmlns:dcc", "https://ptb.de/dcc")
    .attribute("xmlns:si", "https://ptb.de/si")
    .attribute("xmlns:xsi", "http://www.w3.org/2001/XMLSchema-instance")
    .attribute("xsi:schemaLocation", location)
    .attribute("schemaVersion", VERSION))
}

/// A text in English, the language of the results.
fn english(name: &'static str, text: &str) -> Node {
    Node::with(
        name,
        [Node::text("dcc:content", text).attribute("lang", "en")],
    )
}

/// A text of the administrative data, with white space as the schema wants it.
fn text(name: &'static str, text: &Text, language: &str) -> Node {
    let content = |language: &str, text: &str| {
        Node::text("dcc:content", trimmed(text)).attribute("lang", language)
    };
    match text {
        Text::One(own) => Node::with(name, [content(language, own)]),
        Text::ByLanguage(texts) => Node::with(name, texts.iter().map(|(l, t)| content(l, t))),
    }
}

fn trimmed(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

fn leaf(name: &'static str, text: Option<&String>) -> Option<Node> {
    text.map(|text| Node::text(name, trimmed(text)))
}

fn administrative(admin: &Admin) -> Node {
    let language = admin
        .certificate
        .languages
        .first()
        .map_or("en", String::as_str);
    let laboratory = leaf(
        "dcc:calibrationLaboratoryCode",
        admin.certificate.laboratory_code.as_ref(),
    )
    .into_iter()
    .chain([contact("dcc:contact", &admin.laboratory, language)]);
    Node::with(
        "dcc:administrativeData",
        [
            software("dcc:dccSoftware", env!("CARGO_PKG_VERSION")),
            core(&admin.certificate),
            Node::with(
                "dcc:items",
                admin.item.iter().map(|i| thing("dcc:item", i, language)),
            ),
            Node::with("dcc:calibrationLaboratory", laboratory),
            Node::with(
                "dcc:respPersons",
                admin.person.iter().map(|p| person(p, language)),
            ),
            contact("dcc:customer", &admin.customer, language),
        ],
    )
}

fn software(name: &'static str, version: &str) -> Node {
    let own = [
        english("dcc:name", env!("CARGO_PKG_NAME")),
        Node::text("dcc:release", version),
        Node::text("dcc:type", "application"),
    ];
    Node::with(name, [Node::with("dcc:software", own)])
}

fn core(own: &Certificate) -> Node {
    let mut nodes = vec![Node::text("dcc:countryCodeISO3166_1", own.country.as_str())];
    let languages = own.languages.iter();
    nodes.extend(languages.map(|l| Node::text("dcc:usedLangCodeISO639_1", l.as_str())));
    let mandatory = own.languages.first();
    nodes.extend(leaf("dcc:mandatoryLangCodeISO639_1", mandatory));
    nodes.push(Node::text("dcc:uniqueIdentifier", trimmed(&own.identifier)));
    let date = |name, date: &Option<Date>| {
        let day = date.as_ref().and_then(Date::day);
        leaf(name, day.as_ref())
    };
    nodes.extend(date("dcc:receiptDate", &own.received));
    nodes.extend(date("dcc:beginPerformanceDate", &own.begin));
    nodes.extend(date("dcc:endPerformanceDate", &own.end));
    nodes.push(Node::text("dcc:performanceLocation", own.place.as_str()));
    nodes.extend(date("dcc:issueDate", &own.issued));
    Node::with("dcc:coreData", nodes)
}

fn contact(name: &'static str, own: &Contact, language: &str) -> Node {
    let mut nodes = vec![text("dcc:name", &own.name, language)];
    nodes.extend(leaf("dcc:eMail", own.email.as_ref()));
    nodes.extend(leaf("dcc:phone", own.phone.as_ref()));
    nodes.extend(leaf("dcc:fax", own.fax.as_ref()));
    let location = [
        ("dcc:street", &own.street),
        ("dcc:streetNo", &own.street_no),
        ("dcc:postCode", &own.post_code),
        ("dcc:city", &own.city),
        ("dcc:state", &own.state),
        ("dcc:countryCode", &own.country),
    ];
    let location = location
        .iter()
        .filter_map(|(name, text)| leaf(name, text.as_ref()));
    nodes.push(Node::with("dcc:location", location));
    Node::with(name, nodes)
}

fn person(own: &Person, language: &str) -> Node {
    let mut contact = vec![text("dcc:name", &own.name, language)];
    contact.extend(leaf("dcc:eMail", own.email.as_ref()));
    contact.extend(leaf("dcc:phone", own.phone.as_ref()));
    let mut nodes = vec![Node::with("dcc:person", contact)];
    nodes.extend(leaf("dcc:role", own.role.as_ref()));
    nodes.push(Node::text("dcc:mainSigner", own.main_signer.to_string()));
    Node::with("dcc:respPerson", nodes)
}

fn thing(name: &'static str, own: &Thing, language: &str) -> Node {
    let mut nodes = vec![text("dcc:name", &own.name, language)];
    let description = own.description.as_ref();
    nodes.extend(description.map(|d| text("dcc:description", d, language)));
    let manufacturer = own.manufacturer.as_ref();
    nodes.extend(
        manufacturer.map(|m| Node::with("dcc:manufacturer", [text("dcc:name", m, language)])),
    );
    nodes.extend(leaf("dcc:model", own.model.as_ref()));
    if !own.identification.is_empty() {
        let one = own.identification.iter().map(|own| {
            let mut nodes = vec![
                Node::text("dcc:issuer", own.issuer.as_str()),
                Node::text("dcc:value", trimmed(&own.value)),
            ];
            nodes.extend(own.name.as_ref().map(|n| text("dcc:name", n, language)));
            Node::with("dcc:identification", nodes)
        });
        nodes.push(Node::with("dcc:identifications", one));
    }
    Node::with(name, nodes)
}

fn measurement(numbers: &Numbers, admin: &Admin) -> Result<Node, Message> {
    let language = admin
        .certificate
        .languages
        .first()
        .map_or("en", String::as_str);
    let mut method = vec![
        english("dcc:name", &numbers.title),
        english("dcc:description", &numbers.method),
    ];
    method.extend(numbers.norm.map(|norm| Node::text("dcc:norm", norm)));
    let mut nodes = vec![english("dcc:name", &numbers.title)];
    if !numbers.warnings.is_empty() {
        nodes.push(english("dcc:description", &numbers.warnings.join(" ")));
    }
    nodes.push(Node::with(
        "dcc:usedMethods",
        [Node::with("dcc:usedMethod", method)],
    ));
    let version = numbers.version.as_deref();
    nodes.extend(version.map(|version| software("dcc:usedSoftware", version)));
    if !admin.equipment.is_empty() {
        let own = admin
            .equipment
            .iter()
            .map(|e| thing("dcc:measuringEquipment", e, language));
        nodes.push(Node::with("dcc:measuringEquipments", own));
    }
    let results: Vec<Node> = numbers
        .groups
        .iter()
        .map(result)
        .collect::<Result<_, _>>()?;
    nodes.push(Node::with("dcc:results", results));
    Ok(Node::with("dcc:measurementResult", nodes))
}

/// The numbers of one subject: lists over the same positions stand together.
fn result(group: &Group) -> Result<Node, Message> {
    let mut nodes = vec![english("dcc:name", &group.name)];
    if !group.about.is_empty() {
        nodes.push(english("dcc:description", &group.about));
    }
    let of = |list: bool| {
        let entries = group.entries.iter().filter(move |e| e.list == list);
        entries.map(quantity).collect::<Result<Vec<_>, _>>()
    };
    let (mut data, lists) = (of(false)?, of(true)?);
    if !lists.is_empty() {
        data.push(Node::with("dcc:list", lists));
    }
    nodes.push(Node::with("dcc:data", data));
    Ok(Node::with("dcc:result", nodes))
}

fn quantity(entry: &Entry) -> Result<Node, Message> {
    let mut about = entry.about.clone();
    if entry.uncertainty == Uncertainty::None && about.is_empty() {
        about = "The result states no uncertainty of it.".to_owned();
    }
    let mut nodes = vec![english("dcc:name", &entry.name)];
    if !about.is_empty() {
        nodes.push(english("dcc:description", &about));
    }
    nodes.push(si::element(entry)?);
    Ok(Node::with("dcc:quantity", nodes))
}
