//! What the local columns of a run are to the unknowns of band and border.

use errsep_solvers::linear::bordered::Share;

use super::problem::Reversal;
use super::unknowns::Form;

impl Reversal<'_> {
    /// The band unknowns of the local columns of a run: by coefficient, the slide's before the
    /// artefact's, so that the triangle of a run keeps its shape in the band.
    pub(super) fn band_columns(
        &self,
        channel: usize,
        side: usize,
        slide: usize,
    ) -> Vec<Option<usize>> {
        let form = self.unknowns.side_of(self.channels[channel].channel);
        let place = self.unknowns.place(Form::Slide);
        let mut band = Vec::with_capacity(8);
        for k in 0..4 {
            if let Some(m) = place {
                band.push(self.unknowns.coefficient(m, slide + k));
            }
            band.push(self.unknowns.coefficient(form, side + k));
        }
        band
    }

    /// What the local columns of a run are to the unknowns of the border. A constant and ξ are
    /// combinations of the functions of a cell: offset and lines have no column of their own.
    pub(super) fn shares(&self, channel: usize, side: usize, slide: usize) -> Vec<Share> {
        let unknowns = &self.unknowns;
        let name = self.channels[channel].channel;
        let mut shares = Vec::with_capacity(28);
        let mut push = |column: usize, unknown: usize, weight: f64| {
            if weight != 0.0 {
                shares.push(Share {
                    column: column as u32,
                    unknown: unknown as u32,
                    weight,
                });
            }
        };
        let forms = if unknowns.place(Form::Slide).is_some() {
            2
        } else {
            1
        };
        if let Some(form) = unknowns.place(Form::Slide) {
            let [height, slope] = unknowns.line(form);
            for k in 0..4 {
                push(2 * k, unknowns.offset(channel), name.indicator_sign());
                push(2 * k, height, -1.0);
                push(2 * k, slope, -self.xi[form][slide + k]);
            }
        }
        let form = unknowns.side_of(name);
        let [height, slope] = unknowns.line(form);
        for k in 0..4 {
            let column = forms * k + forms - 1;
            push(column, height, -1.0);
            push(column, slope, -self.xi[form][side + k]);
        }
        let mut next = 4 * forms;
        for (j, sign) in unknowns.slope_signs(channel).enumerate() {
            push(next, j, sign);
        }
        next += 1;
        if forms == 1 {
            push(next, unknowns.offset(channel), 1.0);
            next += 1;
        }
        if let Some(thickness) = unknowns.thickness_index() {
            push(next, thickness, 1.0);
            next += 1;
        }
        for k in 0..unknowns.effects.len() {
            push(next + k, unknowns.effect(k), 1.0);
        }
        shares
    }
}
