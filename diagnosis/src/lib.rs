//! Where does the gap between model and readings lie, which effect causes it, how far does it
//! shrink once the effect is added: for any model that offers residuals, Jacobian and effects.
//!
//! The order is that of the functions of [`diagnose`]: noise first, then detection, then places,
//! causes, sizes and the verdict. The method and its sources are in `docs/theory/diagnosis.md`.

mod agreement;
mod attribution;
mod catalogue;
mod detection;
mod diagnose;
mod joined;
mod learning;
mod levels;
mod noise;
mod options;
mod planning;
mod questions;
mod sealing;
mod search;
mod severity;
mod symbolic;
pub mod turning;
mod verdict;

pub use agreement::Agreement;
pub use attribution::reported::{Bias, Candidate, Elsewhere, Linear, ParameterOut};
pub use attribution::shrink::{HeldOut, Size};
pub use catalogue::curve::{Along, Curve, Way};
pub use catalogue::formula::{Circumstances, Formula};
pub use catalogue::tabulated::{Seen, Tabulated, TabulatedEffects};
pub use catalogue::written::{quoted, rounded, written};
pub use detection::smallest::SizesByShape;
pub use joined::{Joined, JoinedEffect, JoinedGap, JoinedProfile, NotJoined};
pub use learning::{HeldOutAlong, Learnt, NotLearnt, Tested};
pub use noise::law::{NoiseLaw, NoiseSource};
pub use options::Options;
pub use planning::certificate::Diagnosability;
pub use planning::prove::Trials;
pub use questions::{
    agreement, certificate, checked, diagnose, diagnose_with, joined, law, learn, prove, sealed,
    tested,
};
pub use sealing::{
    Checked, CheckedEffect, CheckedGap, CheckedNumber, CheckedTrace, Interval, NotSealed, Sealed,
    SealedEffect, SealedGap, SealedNumber, SealedTrace, Standing,
};
pub use severity::{Confidence, Rival, Severity};
pub use symbolic::{Law, LawFound, LawParameter, LawRival, LawTerm, NoLaw, NoRepeats, Power};
pub use verdict::told::{Told, for_people, scaled};
pub use verdict::types::{
    Detail, Diagnosis, Fingerprint, Gap, Harm, Hidden, Kind, Nearest, NoiseOut, Verdict, Where,
};
