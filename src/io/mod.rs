//! The edge of the program: files in, files out, units and messages.

pub mod circle;
pub mod columns;
pub mod diagonal;
pub mod dialect;
pub mod folder;
pub mod fourier;
pub mod machine;
pub mod message;
pub mod output;
pub mod parts;
pub mod plates;
pub mod positioning;
pub mod printable;
pub mod provenance;
pub mod replicates;
pub mod reversal;
pub mod setup;
pub mod source;
pub mod table;
pub mod turning;
pub mod units;

pub use columns::ColumnMap;
pub use folder::{OutFile, OutFolder};
pub use message::{Message, Status, Trouble};
pub use output::CsvTable;
pub use setup::{Numbers, SetupFile};
pub use table::{Column, Row, TableReader};
