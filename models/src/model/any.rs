//! A fitted model of any kind, and its effects, behind one type: what is written for it is compiled
//! once, whatever it is a model of.

use std::any::Any;
use std::borrow::Cow;

use nalgebra::{DMatrix, DVector};

use super::{
    About, Column, Covariate, Effect, Estimate, Fall, FittedModel, Freedom, Link, Parameter,
    Pattern, Place, Profile, Quantity, Record, Shape,
};

/// A fitted model of any kind. It does what the model in it does.
pub struct AnyModel(Box<dyn Behind>);

impl AnyModel {
    /// A copy of a model.
    pub fn new<M: FittedModel + 'static>(model: &M) -> Self {
        let any = (model as &dyn Any).downcast_ref::<Self>();
        any.map_or_else(|| Self(Box::new(model.clone())), Self::clone)
    }

    /// Effects of a model as effects of any.
    ///
    /// # Panics
    /// Such an effect panics where it is asked about a model of another kind.
    pub fn effects_of<M: FittedModel + 'static>(
        effects: Vec<Box<dyn Effect<M>>>,
    ) -> Vec<Box<dyn Effect<Self>>> {
        let effects: Box<dyn Any> = Box::new(effects);
        let effects = match effects.downcast::<Vec<Box<dyn Effect<Self>>>>() {
            Ok(known) => return *known,
            Err(effects) => effects.downcast::<Vec<Box<dyn Effect<M>>>>(),
        };
        let any = |effect| Box::new(AnyEffect(effect)) as Box<dyn Effect<Self>>;
        effects
            .into_iter()
            .flat_map(|known| *known)
            .map(any)
            .collect()
    }

    /// The model itself. Models and effects of one diagnosis are of one kind: both come from one call.
    fn known<M: 'static>(&self) -> &M {
        let model = self.0.as_any().downcast_ref();
        model.expect("a model and its effects are of one kind")
    }
}

impl Clone for AnyModel {
    fn clone(&self) -> Self {
        Self(self.0.copied())
    }
}

/// What [`FittedModel`] offers, in a form that does not name the kind of model. Every method of that
/// trait has its line here and in the two lists below.
trait Behind: Send + Sync {
    fn as_any(&self) -> &dyn Any;
    fn copied(&self) -> Box<dyn Behind>;
    fn name(&self) -> &'static str;
    fn reading_unit(&self) -> &'static str;
    fn position_unit(&self) -> &'static str;
    fn time_unit(&self) -> &'static str;
    fn record(&self) -> &Record;
    fn smooth(&self) -> Option<DVector<f64>>;
    fn freedom(&self) -> Freedom;
    fn linearised(&self) -> DVector<f64>;
    fn channel_names(&self) -> Vec<String>;
    fn trace_name(&self, place: &Place) -> Option<String>;
    fn patterns(&self) -> Vec<Pattern>;
    fn quantities(&self) -> Vec<Quantity>;
    fn profiles(&self) -> Vec<Profile>;
    fn correlated_noise(&self) -> bool;
    fn jumps(&self) -> Vec<DMatrix<f64>>;
    fn names_single_readings(&self) -> bool;
    fn expected_scatter(&self) -> &[Column];
    fn rounding(&self) -> f64;
    fn stated_noise(&self) -> Option<f64>;
    fn readings_in_each(&self) -> f64;
    fn noise_allowance(&self) -> f64;
    fn levelled<'v>(&self, readings: &'v DVector<f64>) -> Cow<'v, DVector<f64>>;
    fn repeats_are_alike(&self) -> bool;
    fn refit(&self, observed: DVector<f64>) -> Box<dyn Behind>;
    fn refit_as_smooth(&self, observed: DVector<f64>) -> Box<dyn Behind>;
    fn as_read(&self) -> Box<dyn Behind>;
    fn smoothed_away(&self, noise: &DVector<f64>) -> Option<DMatrix<f64>>;
    fn roughened(self: Box<Self>, away: &DMatrix<f64>) -> Box<dyn Behind>;
    fn further(&self) -> Vec<(String, AnyModel)>;
    fn covariates(&self) -> Vec<Covariate>;
    fn set_anew(&self) -> Option<DMatrix<f64>>;
    fn beneath(self: Box<Self>, change: &DVector<f64>) -> Box<dyn Behind>;
    fn effects(&self) -> Vec<Box<dyn Effect<AnyModel>>>;
}

impl<M: FittedModel + 'static> Behind for M {
    fn as_any(&self) -> &dyn Any {
        self
    }
    fn copied(&self) -> Box<dyn Behind> {
        Box::new(self.clone())
    }
    fn name(&self) -> &'static str {
        FittedModel::name(self)
    }
    fn reading_unit(&self) -> &'static str {
        FittedModel::reading_unit(self)
    }
    fn position_unit(&self) -> &'static str {
        FittedModel::position_unit(self)
    }
    fn time_unit(&self) -> &'static str {
        FittedModel::time_unit(self)
    }
    fn record(&self) -> &Record {
        FittedModel::record(self)
    }
    fn smooth(&self) -> Option<DVector<f64>> {
        FittedModel::smooth(self)
    }
    fn freedom(&self) -> Freedom {
        FittedModel::freedom(self)
    }
    fn linearised(&self) -> DVector<f64> {
        FittedModel::linearised(self)
    }
    fn channel_names(&self) -> Vec<String> {
        FittedModel::channel_names(self)
    }
    fn trace_name(&self, place: &Place) -> Option<String> {
        FittedModel::trace_name(self, place)
    }
    fn patterns(&self) -> Vec<Pattern> {
        FittedModel::patterns(self)
    }
    fn quantities(&self) -> Vec<Quantity> {
        FittedModel::quantities(self)
    }
    fn profiles(&self) -> Vec<Profile> {
        FittedModel::profiles(self)
    }
    fn correlated_noise(&self) -> bool {
        FittedModel::correlated_noise(self)
    }
    fn jumps(&self) -> Vec<DMatrix<f64>> {
        FittedModel::jumps(self)
    }
    fn names_single_readings(&self) -> bool {
        FittedModel::names_single_readings(self)
    }
    fn expected_scatter(&self) -> &[Column] {
        FittedModel::expected_scatter(self)
    }
    fn rounding(&self) -> f64 {
        FittedModel::rounding(self)
    }
    fn stated_noise(&self) -> Option<f64> {
        FittedModel::stated_noise(self)
    }
    fn readings_in_each(&self) -> f64 {
        FittedModel::readings_in_each(self)
    }
    fn noise_allowance(&self) -> f64 {
        FittedModel::noise_allowance(self)
    }
    fn levelled<'v>(&self, readings: &'v DVector<f64>) -> Cow<'v, DVector<f64>> {
        FittedModel::levelled(self, readings)
    }
    fn repeats_are_alike(&self) -> bool {
        FittedModel::repeats_are_alike(self)
    }
    fn refit(&self, observed: DVector<f64>) -> Box<dyn Behind> {
        Box::new(FittedModel::refit(self, observed))
    }
    fn refit_as_smooth(&self, observed: DVector<f64>) -> Box<dyn Behind> {
        Box::new(FittedModel::refit_as_smooth(self, observed))
    }
    fn as_read(&self) -> Box<dyn Behind> {
        Box::new(FittedModel::as_read(self))
    }
    fn smoothed_away(&self, noise: &DVector<f64>) -> Option<DMatrix<f64>> {
        FittedModel::smoothed_away(self, noise)
    }
    fn roughened(self: Box<Self>, away: &DMatrix<f64>) -> Box<dyn Behind> {
        Box::new(FittedModel::roughened(*self, away))
    }
    fn further(&self) -> Vec<(String, AnyModel)> {
        let any = |(words, model): (String, Self)| (words, AnyModel(Box::new(model)));
        FittedModel::further(self).into_iter().map(any).collect()
    }
    fn covariates(&self) -> Vec<Covariate> {
        FittedModel::covariates(self)
    }
    fn set_anew(&self) -> Option<DMatrix<f64>> {
        FittedModel::set_anew(self)
    }
    fn beneath(self: Box<Self>, change: &DVector<f64>) -> Box<dyn Behind> {
        Box::new(FittedModel::beneath(*self, change))
    }
    fn effects(&self) -> Vec<Box<dyn Effect<AnyModel>>> {
        AnyModel::effects_of(FittedModel::effects(self))
    }
}

impl FittedModel for AnyModel {
    fn name(&self) -> &'static str {
        self.0.name()
    }
    fn reading_unit(&self) -> &'static str {
        self.0.reading_unit()
    }
    fn position_unit(&self) -> &'static str {
        self.0.position_unit()
    }
    fn time_unit(&self) -> &'static str {
        self.0.time_unit()
    }
    fn record(&self) -> &Record {
        self.0.record()
    }
    fn smooth(&self) -> Option<DVector<f64>> {
        self.0.smooth()
    }
    fn freedom(&self) -> Freedom {
        self.0.freedom()
    }
    fn linearised(&self) -> DVector<f64> {
        self.0.linearised()
    }
    fn channel_names(&self) -> Vec<String> {
        self.0.channel_names()
    }
    fn trace_name(&self, place: &Place) -> Option<String> {
        self.0.trace_name(place)
    }
    fn patterns(&self) -> Vec<Pattern> {
        self.0.patterns()
    }
    fn quantities(&self) -> Vec<Quantity> {
        self.0.quantities()
    }
    fn profiles(&self) -> Vec<Profile> {
        self.0.profiles()
    }
    fn correlated_noise(&self) -> bool {
        self.0.correlated_noise()
    }
    fn jumps(&self) -> Vec<DMatrix<f64>> {
        self.0.jumps()
    }
    fn names_single_readings(&self) -> bool {
        self.0.names_single_readings()
    }
    fn expected_scatter(&self) -> &[Column] {
        self.0.expected_scatter()
    }
    fn rounding(&self) -> f64 {
        self.0.rounding()
    }
    fn stated_noise(&self) -> Option<f64> {
        self.0.stated_noise()
    }
    fn readings_in_each(&self) -> f64 {
        self.0.readings_in_each()
    }
    fn noise_allowance(&self) -> f64 {
        self.0.noise_allowance()
    }
    fn levelled<'v>(&self, readings: &'v DVector<f64>) -> Cow<'v, DVector<f64>> {
        self.0.levelled(readings)
    }

    fn repeats_are_alike(&self) -> bool {
        self.0.repeats_are_alike()
    }
    fn refit(&self, observed: DVector<f64>) -> Self {
        Self(self.0.refit(observed))
    }
    fn refit_as_smooth(&self, observed: DVector<f64>) -> Self {
        Self(self.0.refit_as_smooth(observed))
    }
    fn as_read(&self) -> Self {
        Self(self.0.as_read())
    }
    fn smoothed_away(&self, noise: &DVector<f64>) -> Option<DMatrix<f64>> {
        self.0.smoothed_away(noise)
    }
    fn roughened(self, away: &DMatrix<f64>) -> Self {
        Self(self.0.roughened(away))
    }
    fn further(&self) -> Vec<(String, Self)> {
        self.0.further()
    }
    fn covariates(&self) -> Vec<Covariate> {
        self.0.covariates()
    }

    fn set_anew(&self) -> Option<DMatrix<f64>> {
        self.0.set_anew()
    }
    fn beneath(self, change: &DVector<f64>) -> Self {
        Self(self.0.beneath(change))
    }
    fn effects(&self) -> Vec<Box<dyn Effect<Self>>> {
        self.0.effects()
    }
}

/// An effect of one kind of model as an effect of any.
struct AnyEffect<M>(Box<dyn Effect<M>>);

impl<M: FittedModel + 'static> Effect<AnyModel> for AnyEffect<M> {
    fn name(&self) -> &str {
        self.0.name()
    }
    fn about(&self) -> About {
        self.0.about()
    }
    fn amplitudes(&self) -> Vec<Parameter> {
        self.0.amplitudes()
    }
    fn amplitudes_at(&self, shape: &Shape) -> Vec<Parameter> {
        self.0.amplitudes_at(shape)
    }
    fn shape_parameters(&self) -> Vec<Parameter> {
        self.0.shape_parameters()
    }
    fn grid(&self, model: &AnyModel) -> Vec<Shape> {
        self.0.grid(model.known())
    }
    fn relatives(&self, model: &AnyModel, shape: &Shape) -> Vec<Shape> {
        self.0.relatives(model.known(), shape)
    }
    fn columns(&self, model: &AnyModel, shape: &Shape) -> Vec<Column> {
        self.0.columns(model.known(), shape)
    }
    fn link(&self, shape: &Shape) -> Link {
        self.0.link(shape)
    }
    fn is_linear_in_state(&self) -> bool {
        self.0.is_linear_in_state()
    }
    fn absorbed(&self) -> bool {
        self.0.absorbed()
    }
    fn open(&self, model: &AnyModel, shape: &Shape) -> Vec<Column> {
        self.0.open(model.known(), shape)
    }
    fn limit(&self, model: &AnyModel, shape: &Shape) -> Vec<Column> {
        self.0.limit(model.known(), shape)
    }
    fn cycles(&self, model: &AnyModel, shape: &Shape) -> Vec<(usize, f64)> {
        self.0.cycles(model.known(), shape)
    }
    fn changed(
        &self,
        model: &AnyModel,
        shape: &Shape,
        value: usize,
    ) -> Option<(Vec<usize>, Column)> {
        self.0.changed(model.known(), shape, value)
    }
    fn falls(&self, model: &AnyModel, shape: &Shape) -> Vec<Fall> {
        self.0.falls(model.known(), shape)
    }
    fn allowed(&self, model: &AnyModel, shape: &Shape) -> bool {
        self.0.allowed(model.known(), shape)
    }
    fn possible(&self, model: &AnyModel, shape: &Shape, amplitudes: &[f64]) -> bool {
        self.0.possible(model.known(), shape, amplitudes)
    }
    fn settled(&self, shape: &Shape, amplitudes: &[f64]) -> Option<Shape> {
        self.0.settled(shape, amplitudes)
    }
    fn traced(
        &self,
        model: &AnyModel,
        readings: &dyn Fn() -> Option<DVector<f64>>,
        shape: &Shape,
    ) -> Option<Shape> {
        self.0.traced(model.known(), readings, shape)
    }
    fn choices(&self, shape: &Shape) -> usize {
        self.0.choices(shape)
    }
    fn carried(
        &self,
        from: &AnyModel,
        to: &AnyModel,
        shape: &Shape,
        amplitudes: &[f64],
    ) -> (Shape, Vec<f64>) {
        self.0.carried(from.known(), to.known(), shape, amplitudes)
    }
    fn restored(
        &self,
        model: &AnyModel,
        shape: &Shape,
        readings: &DVector<f64>,
        clean: &DVector<f64>,
    ) -> Option<DVector<f64>> {
        self.0.restored(model.known(), shape, readings, clean)
    }
    fn moments(&self, model: &AnyModel, shape: &Shape) -> Vec<f64> {
        self.0.moments(model.known(), shape)
    }
    fn variant_name(&self, model: &AnyModel, shape: &Shape) -> Option<String> {
        self.0.variant_name(model.known(), shape)
    }
    fn estimates(
        &self,
        shape: &Shape,
        amplitudes: &[f64],
        covariance: &DMatrix<f64>,
    ) -> Vec<Estimate> {
        self.0.estimates(shape, amplitudes, covariance)
    }
}
