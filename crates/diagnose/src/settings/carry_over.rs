//! What carries over to other sessions and kinds of path.

rules::settings! {
    CarryOver
    /// Standard deviations. A unit is asked where the others determine the size so well.
    /// Convention: three standard deviations.
    min_sigmas_of_others: f64 = 3.0,
    /// Standard deviations. Half of the others' size over the standard deviation of the contrast: a unit is
    /// asked where it would show that size.
    /// Derived: Φ⁻¹(0.95) + Φ⁻¹(0.9), power 0.9 at a one-sided level of 5 %.
    min_power_sigmas: f64 = 2.93,
    /// Number. Testable units that must agree.
    /// Convention: one unit agrees with anything.
    min_testable_units: usize = 2,
    /// Standard deviations. A unit supports a term where its contrast is above nothing by more.
    /// Derived: Φ⁻¹(0.95), one-sided.
    supported_sigmas: f64 = 1.645,
    /// Probability. Family-wise level at which one of the units refutes a term.
    /// Convention: 5 %, one-sided.
    refuted_level: f64 = 0.05,
    /// Ratio. A run spins where its wheels travel so much farther against each other than along.
    /// Convention: four times.
    min_spin_turn_ratio: f64 = 4.0,
    /// Ratio. A run is straight where its wheels travel less against each other, over what they travel along.
    /// Convention: a tenth of a radian on a path as long as the wheelbase.
    max_straight_turn_ratio: f64 = 0.05,
    /// Fraction of all turns, left or right, that a circle turns one way.
    /// Convention: nine tenths.
    one_sense_share: f64 = 0.9,
    /// Ratio. Standard deviation of a circle's curvature along its path over the mean.
    /// Convention: a half; a square with corners on the spot has several times its mean.
    constant_curvature_spread: f64 = 0.5,
    /// Probability. A term stays open where a new unit has less than half of its size more probably.
    /// Convention: 5 %.
    max_less_than_half: f64 = 0.05,
    /// Probability. Level of Cochran's Q at which units are taken to differ.
    /// Convention: 10 %, as its power is low with few units (Higgins and Thompson 2002).
    heterogeneity_level: f64 = 0.1,
    /// Probability. Where no other session or kind of path was driven, a term is in the extended model whose
    /// cause is so probable.
    /// Derived: more likely than all others together.
    min_established_probability: f64 = 0.5,
}
