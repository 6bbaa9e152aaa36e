//! Many products of covariates as one term: what a library of them asks of an interval is found once for all.
//!
//! A library has hundreds of products of a few dozen covariates, most of them on several channels. The
//! moment, the value of each covariate at it and each product are found once; a sine and a cosine of the same
//! angle come together.

use dataset::RunInfo;
use kinematics::{Pose, Side, Wheels};
use model_term::{Interval, ModelTerm, TermParameter};

use super::recorded::PreviousIntervals;
use super::sparse::{Sparse, on_channel, parameter};
use crate::channel::Channel;
use crate::covariate::{Covariate, KinematicSample};

/// Products on channels of the motion and of the wheels, a parameter each.
#[derive(Clone)]
pub(super) struct ProductBatch {
    past: PreviousIntervals,
    /// What the products are made of, each once, and its value by what each wheel does itself.
    covariates: Vec<Covariate>,
    values: Vec<Wheels<f64>>,
    /// The products, each once, by the places of their factors, and what they come to.
    factors: Vec<Vec<usize>>,
    products: Vec<Wheels<f64>>,
    /// For each parameter its channel and the place of its product.
    on: Vec<(Channel, usize)>,
    parameters: Vec<TermParameter>,
}

/// The place of something in a list, at the end of which it is put where it is not yet in it.
fn place<T: PartialEq>(list: &mut Vec<T>, of: T) -> usize {
    list.iter().position(|own| *own == of).unwrap_or_else(|| {
        list.push(of);
        list.len() - 1
    })
}

impl ProductBatch {
    pub(super) fn new(all: &[Sparse]) -> Self {
        let (mut covariates, mut factors, mut on) = (Vec::new(), Vec::new(), Vec::new());
        for Sparse { channel, covariates: own } in all {
            let own = own.iter().map(|covariate| place(&mut covariates, covariate.clone())).collect();
            on.push((*channel, place(&mut factors, own)));
        }
        Self {
            past: PreviousIntervals::NONE,
            values: vec![Wheels::both(0.0); covariates.len()],
            covariates,
            products: vec![Wheels::both(0.0); factors.len()],
            factors,
            on,
            parameters: all.iter().map(parameter).collect(),
        }
    }

    /// Finds every product at a moment.
    fn find(&mut self, at: &KinematicSample<'_>) {
        let (left, right) = (at.of_wheel(Side::Left), at.of_wheel(Side::Right));
        let mut last = None;
        let mut of_cycle = |side: Side, cycles: u8| match last {
            Some((of, found)) if of == (side, cycles) => found,
            _ => last.insert(((side, cycles), at.of_cycle(side, cycles))).1,
        };
        for (value, covariate) in self.values.iter_mut().zip(&self.covariates) {
            *value = match covariate {
                Covariate::SinPhase(side, cycles) => Wheels::both(of_cycle(*side, *cycles).0),
                Covariate::CosPhase(side, cycles) => Wheels::both(of_cycle(*side, *cycles).1),
                _ if covariate.is_of_a_wheel() => {
                    Wheels { left: covariate.value(&left), right: covariate.value(&right) }
                }
                _ => Wheels::both(covariate.value(at)),
            };
        }
        for (product, factors) in self.products.iter_mut().zip(&self.factors) {
            let times = |product: Wheels<f64>, factor: &usize| product.zip_with(self.values[*factor], |a, b| a * b);
            *product = factors.iter().fold(Wheels::both(1.0), times);
        }
    }
}

impl ModelTerm for ProductBatch {
    fn parameters(&self) -> &[TermParameter] {
        &self.parameters
    }

    fn restart(&mut self, _run: &RunInfo) {
        self.past = PreviousIntervals::NONE;
    }

    fn motion(&mut self, interval: &Interval<'_>, gradient: &mut [Pose]) {
        if interval.dt_s <= 0.0 {
            return;
        }
        let at = self.past.sample(interval);
        self.find(&at);
        for (gradient, (channel, product)) in gradient.iter_mut().zip(&self.on) {
            let gained = self.products[*product].map(|product| product * interval.dt_s);
            *gradient = if channel.is_of_wheels() {
                interval.change(Wheels::from_sides(|side| if channel.is_of(side) { gained[side] } else { 0.0 }))
            } else {
                // Covariates of a motion are the same whichever wheel is asked.
                on_channel(*channel, gained.left, at.twist())
            };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::covariate::Covariate::{
        AbsWheelSpeed, Acceleration, CosHeading, CosPhase, RunTime, SinPhase, SinceReversal, Speed, WheelSpeed, YawRate,
    };

    #[test]
    fn each_product_gains_what_it_gains_alone() {
        let products = [
            vec![Speed, CosHeading],
            vec![YawRate, RunTime],
            vec![Acceleration],
            vec![SinceReversal, Speed],
            vec![CosPhase(Side::Left, 5)],
            vec![SinPhase(Side::Left, 5)],
            vec![SinPhase(Side::Right, 5)],
        ];
        let on = |channel, covariates: &Vec<Covariate>| Sparse { channel, covariates: covariates.clone() };
        let mut all: Vec<Sparse> =
            products.iter().flat_map(|product| Channel::MOTION.map(|channel| on(channel, product))).collect();
        all.extend(Channel::WHEELS.map(|channel| on(channel, &vec![WheelSpeed, AbsWheelSpeed])));
        all.push(on(Channel::RightWheel, &vec![CosPhase(Side::Right, 5)]));
        let mut each: Vec<Box<dyn ModelTerm>> = all.iter().map(Sparse::term).collect();
        let mut product_batch = Sparse::batched(&all).expect("of the motion and the wheels");
        let run = RunInfo::default();
        // On, back, and standing in no time.
        for (number, (left_rad, right_rad, dt_s)) in
            [(0.5, 0.4, 0.1), (0.3, 0.5, 0.1), (-0.6, -0.2, 0.2), (0.0, 0.0, 0.0), (-0.1, 0.4, 0.1)]
                .into_iter()
                .enumerate()
        {
            let turned_rad = Wheels { left: left_rad, right: right_rad };
            let t_s = f64::from(u8::try_from(number).expect("few"));
            let interval = Interval {
                t_s,
                dt_s,
                late_s: [0.0; 2],
                travel_m: turned_rad.map(|rad| 0.08 * rad),
                speed_m_s: turned_rad.map(|rad| 0.08 * rad / f64::max(dt_s, 0.1)),
                count_m: Wheels::both(0.0),
                speed_at_ends_m_s: [Wheels::both(0.1 * t_s), Wheels { left: 0.2, right: 0.3 * t_s }],
                wheel_separation_m: 0.36,
                wheel_rad: Wheels { left: 1.1 * t_s, right: 0.9 * t_s },
                turned_rad,
                world_from_body: Pose::new(1.0, 2.0, 0.7 + t_s),
                session_m: 3.0,
                run: &run,
            };
            let mut gained = vec![Pose::IDENTITY; all.len()];
            product_batch.motion(&interval, &mut gained);
            for ((alone, gained), sparse) in each.iter_mut().zip(gained).zip(&all) {
                let mut own = [Pose::IDENTITY];
                alone.motion(&interval, &mut own);
                assert_eq!(own[0], gained, "{sparse:?}");
            }
        }
    }

    #[test]
    fn what_is_seen_and_what_goes_with_rows_stands_alone() {
        let seen = Sparse { channel: Channel::OffsetAlong, covariates: vec![Speed] };
        for other in [seen, Sparse::of_rows()] {
            assert!(!other.shares_samples() && Sparse::batched(&[other]).is_none());
        }
    }
}
