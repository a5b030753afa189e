//! What a measurement can show: the certificate of a plan, what would split a group of effects, and the
//! proof by injection.

pub(super) mod certificate;
pub(super) mod prove;
pub(super) mod splitting;
