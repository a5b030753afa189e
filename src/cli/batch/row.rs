//! One row of the answers.

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::lean::Lean;

/// The schema of a row.
const SCHEMA: &str = "errsep.batch/1";

/// What a campaign came to.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Row {
    schema: &'static str,
    /// Id of the campaign.
    pub id: String,
    /// SHA-256 of files, options and version.
    pub key: String,
    /// `done` or `failed`.
    pub status: Status,
    /// Exit status that the command would have had.
    pub exit: u8,
    /// Why it failed.
    pub message: Option<String>,
    /// The command's JSON without times and provenance.
    pub result: Option<Value>,
}

/// What a row is about, as it is read back.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
pub(super) struct Head {
    pub id: String,
    pub key: String,
    pub status: Status,
}

/// A row without its lists of numbers, as it is read back.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub(super) struct LeanRow {
    pub id: String,
    pub key: String,
    pub status: Status,
    pub exit: u8,
    pub message: Option<String>,
    pub result: Option<Lean>,
}

/// Whether there is an answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Status {
    Done,
    Failed,
}

impl Row {
    /// The row of a campaign.
    pub fn new(
        (id, key): (String, String),
        exit: u8,
        message: Option<String>,
        mut result: Option<Value>,
    ) -> Self {
        if let Some(result) = &mut result {
            without_times(result);
        }
        Self {
            schema: SCHEMA,
            id,
            key,
            status: if exit == 0 {
                Status::Done
            } else {
                Status::Failed
            },
            exit,
            message,
            result,
        }
    }
}

/// Takes out what differs from run to run.
fn without_times(value: &mut Value) {
    match value {
        Value::Object(object) => {
            object.shift_remove("seconds");
            object.values_mut().for_each(without_times);
        }
        Value::Array(array) => array.iter_mut().for_each(without_times),
        _ => {}
    }
}
