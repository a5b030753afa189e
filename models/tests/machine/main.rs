//! The 21-error machine, diagonals, positioning, analysis of variance, uncertainty.

mod anova;
mod anova_tables;
mod components;
mod diagonal_edges;
mod diagonal_estimators;
mod diagonal_limits;
mod diagonal_reversal;
mod diagonal_statements;
mod diagonal_truth;
mod fixtures;
mod kinematics;
mod measured_parts;
mod monte_carlo;
mod positioning;
mod published_machine;
mod quantities;
mod report_machine;
mod uncertainty;
