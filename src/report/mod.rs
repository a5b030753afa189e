//! Report pages: one self-contained HTML file that opens offline, prints on A4 and reads in grey.
//!
//! A command describes its result as a [`Page`] of [`Section`]s and blocks; [`Page::render`] turns
//! that into HTML with the plots as inline SVG. Styles and the small script that shows values
//! under the pointer are part of the file; without script the page is complete all the same.
//!
//! ```
//! use errsep::report::{
//!     Cell, Figure, KeyFigure, Page, Provenance, Section, Standing, Table,
//!     plot::{Axis, Chart, Series},
//! };
//!
//! let x = vec![0.0, 10.0, 20.0];
//! let page = Page::new("Straightness", "slide.csv")
//!     .summary(Standing::Good, "The slide is straight to 0.4 µm.")
//!     .section(
//!         Section::new("Result")
//!             .key_figures([KeyFigure::new("Straightness", 0.41, "µm")
//!                 .std(0.03)
//!                 .meaning("minimum zone")])
//!             .table(
//!                 Table::new("Straightness by reference line", ["reference", "error (µm)"])
//!                     .row(["minimum zone".into(), Cell::measured(0.41, 0.03)]),
//!             )
//!             .figure(Figure::new(
//!                 "Form of the slide",
//!                 "Deviation from the least-squares line with its 95 % band.",
//!                 Chart::new(Axis::new("slide position x", "mm"), Axis::new("deviation", "µm"))
//!                     .series(Series::line("M", x, vec![0.1, -0.2, 0.1]).half_band(vec![0.06; 3])),
//!             )),
//!     )
//!     .provenance(Provenance { version: "0.1.0".into(), ..Provenance::default() });
//! let html = page.render();
//! assert!(html.starts_with("<!DOCTYPE html>"));
//! ```

pub mod anova;
pub mod budget;
pub mod circle;
pub mod diagnosis;
pub mod fourier;
mod html;
pub use crate::number;
mod page;
pub mod plot;
pub mod positioning;
pub mod reversal;
pub mod simulation;
pub mod step_diagonal;
pub mod straightness;
mod table;
pub mod turning_bar;

pub use page::{Block, Figure, KeyFigure, Page, Provenance, Section, Standing};
pub use table::{Cell, Order, Table};
