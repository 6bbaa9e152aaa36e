//! What is written is read back to the last bit, whatever the tables.

use std::collections::BTreeMap;

use dataset::{
    Dataset, Displacement, Existing, ExtraChannel, GyroSample, MarkedPoint, NominalRobot, Odometry, PointReading,
    PoseCovariance, Protocol, ProtocolSettings, Provenance, Revisit, Run, RunByRun, RunInfo, TapeDistance, Timestamp,
    TruthNoise, TruthSample, TruthSigma, WallReading, WheelLog, WheelSpeed, read, write,
};
use kinematics::{Point, Wheels};
use proptest::collection::{btree_map, vec};
use proptest::option;
use proptest::prelude::*;

/// Any finite number, subnormal, huge and −0 included.
fn number() -> impl Strategy<Value = f64> {
    prop_oneof![
        prop::num::f64::NORMAL | prop::num::f64::SUBNORMAL | prop::num::f64::ZERO,
        -10.0..10.0,
        (-50_i32..50).prop_map(f64::from),
    ]
}

fn positive() -> impl Strategy<Value = f64> {
    prop_oneof![prop::num::f64::POSITIVE | prop::num::f64::NORMAL | prop::num::f64::SUBNORMAL, 0.001..10.0,]
        .prop_map(f64::abs)
}

/// Increasing times, near and far apart.
fn times(rows: usize) -> impl Strategy<Value = Vec<f64>> {
    (-5.0..5.0_f64, vec(prop_oneof![1e-9..1.0, Just(0.05), 1.0..1e6], rows)).prop_map(|(start_s, steps_s)| {
        let mut t_s = start_s;
        steps_s
            .iter()
            .map(|step_s| {
                t_s += step_s;
                t_s
            })
            .collect()
    })
}

/// Ids with everything that a table or TOML could stumble over.
fn id() -> impl Strategy<Value = String> {
    prop_oneof!["[a-z_0-9]{1,8}", "[ -~äöß€]{1,12}", Just("a,\"b\" ".to_owned()), Just("  ".to_owned())]
}

fn text() -> impl Strategy<Value = Option<String>> {
    option::of(prop_oneof!["[ -~]{0,20}", "[\\PC\n\r\t\"\\\\']{0,20}"])
}

#[derive(Debug, Clone, Copy)]
enum Form {
    Ticks,
    Angles,
    Speeds,
    Twist,
}

fn wheels(form: Form, rows: usize) -> BoxedStrategy<WheelLog> {
    let numbers = || vec(number(), rows);
    match form {
        Form::Ticks => (vec(-(1_i64 << 56)..=1 << 56, rows), vec(-500_i64..500, rows))
            .prop_map(|(left, right)| WheelLog::Ticks(Wheels { left, right }))
            .boxed(),
        Form::Angles => {
            (numbers(), numbers()).prop_map(|(left, right)| WheelLog::Angles(Wheels { left, right })).boxed()
        }
        Form::Speeds => {
            (numbers(), numbers()).prop_map(|(left, right)| WheelLog::Speeds(Wheels { left, right })).boxed()
        }
        Form::Twist => {
            (numbers(), numbers()).prop_map(|(v_mps, omega_radps)| WheelLog::Twist { v_mps, omega_radps }).boxed()
        }
    }
}

fn odometry(form: Form) -> impl Strategy<Value = Odometry> {
    (1_usize..6).prop_flat_map(move |rows| {
        let channel = || option::of(vec(number(), rows));
        (times(rows), wheels(form, rows), channel(), channel(), channel()).prop_map(|(t_s, wheels, a, b, c)| {
            let extra =
                ExtraChannel::ALL.into_iter().zip([a, b, c]).filter_map(|(channel, values)| Some((channel, values?)));
            Odometry { t_s: t_s.into(), wheels, extra: extra.collect() }
        })
    })
}

/// L Lᵀ of a lower triangular L.
fn covariance() -> impl Strategy<Value = PoseCovariance> {
    ([0.01..10.0, 0.01..10.0, 0.01..10.0], [-1.0..1.0, -1.0..1.0, -1.0..1.0]).prop_map(|([a, c, f], [b, d, e])| {
        let elements = [a * a, a * b, a * d, b * b + c * c, b * d + c * e, d * d + e * e + f * f];
        PoseCovariance::stated(elements).expect("possible").expect("stated")
    })
}

fn truth() -> impl Strategy<Value = (Vec<TruthSample>, Option<Vec<TruthSigma>>)> {
    (0_usize..5).prop_flat_map(|rows| {
        let poses = vec((number(), number(), option::of(number())), rows);
        let sigmas = vec((option::of(positive()), option::of(positive()), option::of(covariance())), rows);
        (times(rows), poses, sigmas).prop_map(|(times_s, poses, sigmas)| {
            let samples: Vec<_> =
                times_s.iter().zip(poses).map(|(&t_s, (x, y, theta))| TruthSample::new(t_s, x, y, theta)).collect();
            let mut sigmas: Vec<_> = sigmas
                .into_iter()
                .map(|(sigma_xy_m, sigma_theta_rad, covariance)| TruthSigma { sigma_xy_m, sigma_theta_rad, covariance })
                .collect();
            // Of a position, what a row states of the heading is left out.
            for (sigma, _) in sigmas.iter_mut().zip(&samples).filter(|(_, sample)| sample.theta_rad().is_none()) {
                sigma.covariance = sigma.covariance.and_then(|of| of.of_position());
            }
            // Sigmas that are all unknown have no form of their own.
            let known = sigmas.iter().any(|sigma| *sigma != TruthSigma::UNKNOWN);
            (samples, known.then_some(sigmas))
        })
    })
}

fn gyro() -> impl Strategy<Value = Vec<GyroSample>> {
    (0_usize..4).prop_flat_map(|rows| {
        let sample = |(t_s, omega_radps)| GyroSample { t_s, omega_radps };
        (times(rows), vec(number(), rows))
            .prop_map(move |(t_s, rates)| t_s.into_iter().zip(rates).map(sample).collect())
    })
}

fn displacements() -> impl Strategy<Value = Vec<Displacement>> {
    (0_usize..5).prop_flat_map(|rows| {
        (times(2 * rows), vec((number(), number(), number()), rows)).prop_map(|(times_s, steps)| {
            let steps = times_s.chunks(2).zip(steps);
            steps
                .map(|(t, (dx_m, dy_m, dtheta_rad))| Displacement { t0_s: t[0], t1_s: t[1], dx_m, dy_m, dtheta_rad })
                .collect()
        })
    })
}

/// Readings of some of `points` points at some instants.
fn point_readings(points: usize) -> impl Strategy<Value = Vec<PointReading>> {
    (0_usize..4).prop_flat_map(move |instants| {
        (times(instants), vec(vec(option::of((number(), number())), points), instants)).prop_map(|(times_s, read)| {
            let mut readings = Vec::new();
            for (t_s, at_once) in times_s.into_iter().zip(read) {
                for (point, place) in at_once.into_iter().enumerate() {
                    readings.extend(place.map(|(x, y)| PointReading { t_s, point, room: Point::new(x, y) }));
                }
            }
            readings
        })
    })
}

fn wheel_reference() -> impl Strategy<Value = Vec<WheelSpeed>> {
    (0_usize..5).prop_flat_map(|rows| {
        (times(rows), vec((number(), number()), rows)).prop_map(|(times_s, speeds)| {
            let speeds = times_s.into_iter().zip(speeds);
            speeds.map(|(t_s, (left, right))| WheelSpeed { t_s, speed_m_s: Wheels { left, right } }).collect()
        })
    })
}

fn partial() -> impl Strategy<Value = (Vec<Revisit>, Vec<TapeDistance>, Vec<WallReading>)> {
    let revisit = (times(2), option::of(number()), option::of(number()), number(), positive(), positive());
    let distance = (times(2), positive(), positive());
    let wall = || (id(), number(), option::of(number()), positive(), positive());
    (vec(revisit, 0..3), vec(distance, 0..3), (0_usize..4).prop_flat_map(move |rows| (times(rows), vec(wall(), rows))))
        .prop_map(|(revisits, distances, (walls_s, walls))| {
            let revisits = revisits.into_iter().map(|(t, dx_m, dy_m, dtheta_rad, sigma_m, sigma_rad)| Revisit {
                t0_s: t[0],
                t1_s: t[1],
                dx_m,
                dy_m,
                dtheta_rad: Some(dtheta_rad),
                sigma_xy_m: dx_m.or(dy_m).map(|_| sigma_m),
                sigma_theta_rad: Some(sigma_rad),
            });
            let distances = distances.into_iter().map(|(t, distance_m, sigma_m)| TapeDistance {
                t0_s: t[0],
                t1_s: t[1],
                distance_m,
                sigma_m,
            });
            let walls =
                walls_s.into_iter().zip(walls).map(|(t_s, (wall, distance_m, heading_rad, m, rad))| WallReading {
                    t_s,
                    wall,
                    distance_m: Some(distance_m),
                    heading_rad,
                    sigma_m: Some(m),
                    sigma_rad: heading_rad.map(|_| rad),
                });
            let (mut revisits, mut distances): (Vec<_>, Vec<_>) = (revisits.collect(), distances.collect());
            revisits.sort_by(|a, b| a.t0_s.total_cmp(&b.t0_s));
            distances.sort_by(|a, b| a.t0_s.total_cmp(&b.t0_s));
            (revisits, distances, walls.collect())
        })
}

fn info() -> impl Strategy<Value = RunInfo> {
    use Protocol::{CircleCcw, CircleCw, Free, Path, Spin, SquareCcw, SquareCw, Straight};
    let protocols = vec![Straight, Spin, SquareCw, SquareCcw, CircleCw, CircleCcw, Path, Free];
    let settings = (option::of(positive()), option::of(positive()), option::of(number()), option::of(number()));
    (id(), option::of(prop::sample::select(protocols)), settings, option::of(number()), any::<bool>(), covariates())
        .prop_map(|(id, protocol, (side_m, radius_m, length_m, turn_rad), start_s, continuous, covariates)| RunInfo {
            id,
            protocol,
            settings: ProtocolSettings { side_m, radius_m, length_m, turn_rad },
            start_s,
            continuous,
            covariates,
        })
}

fn covariates() -> impl Strategy<Value = BTreeMap<String, f64>> {
    btree_map(prop_oneof!["[a-z]{1,6}_kg", "odd [ -~ä]{0,5}"], number(), 0..3)
}

fn run(form: Form, points: usize) -> impl Strategy<Value = Run> {
    let seen = (truth(), displacements(), point_readings(points), wheel_reference(), gyro());
    (info(), odometry(form), seen, partial())
        .prop_filter("a run needs some truth", |(_, _, ((truth, _), steps, readings, speeds, _), partial)| {
            let (revisits, distances, walls) = partial;
            !(truth.is_empty() && steps.is_empty() && readings.is_empty() && speeds.is_empty())
                || !(revisits.is_empty() && distances.is_empty() && walls.is_empty())
        })
        .prop_map(|(info, odometry, seen, (revisits, distances, walls))| {
            let ((truth, truth_sigma), displacements, point_readings, wheel_reference, gyro) = seen;
            Run {
                info,
                odometry,
                truth,
                truth_sigma,
                headings: Vec::new(),
                gyro,
                displacements,
                point_readings,
                wheel_reference,
                revisits,
                distances,
                walls,
                unknown_motion: Vec::new(),
                restored_motion: Vec::new(),
                session_m: None,
                wheels_ahead_rad: Wheels::both(0.0),
            }
        })
}

fn datasets() -> impl Strategy<Value = Dataset> {
    let form = prop::sample::select(vec![Form::Ticks, Form::Angles, Form::Speeds, Form::Twist]);
    let points = btree_map(id(), (number(), number()), 0..3);
    (form, points).prop_flat_map(|(form, points)| {
        let points: Vec<_> =
            points.into_iter().map(|(id, (x, y))| MarkedPoint { id, body: Point::new(x, y) }).collect();
        let robot = (positive(), positive(), positive(), positive());
        let recorded =
            option::of((-1_000_000_000_i64..4_000_000_000).prop_map(|s| Timestamp::from_second(s).expect("a year")));
        let provenance = (text(), text(), text(), text(), option::of("[a-z]{1,6} 7"), recorded);
        let noise = (option::of(positive()), option::of(positive()));
        (provenance, robot, noise, vec(run(form, points.len()), 1..4)).prop_map(
            move |(
                (name, licence, source, notes, robot_id, recorded),
                (left, right, separation, ticks_per_rev),
                noise,
                mut runs,
            )| {
                let mut ids = std::collections::BTreeSet::new();
                runs.retain(|run| ids.insert(run.info.id.clone()));
                let mut dataset = Dataset {
                    provenance: Provenance { name, licence, source, notes, robot_id, recorded },
                    robot: NominalRobot {
                        left_wheel_diameter_m: left,
                        right_wheel_diameter_m: right,
                        wheel_separation_m: separation,
                        ticks_per_rev: Some(ticks_per_rev),
                        counter_bits: None,
                    },
                    truth_noise: TruthNoise { sigma_xy_m: noise.0, sigma_theta_rad: noise.1, ..TruthNoise::default() },
                    points: points.clone(),
                    runs,
                };
                // As a reader does: two runs that begin at the same counts are angles that go on.
                dataset.carry_wheel_angles();
                dataset
            },
        )
    })
}

/// What a dataset gives one run at a time.
fn run_by_run(dir: &std::path::Path) -> (Vec<Run>, Vec<dataset::Warning>) {
    let opened = RunByRun::open(dir).expect("readable");
    let (mut runs, mut warnings) = (Vec::new(), opened.warnings().to_vec());
    for loaded in opened {
        let mut loaded = loaded.expect("readable");
        assert_eq!(loaded.dataset.runs.len(), 1);
        runs.append(&mut loaded.dataset.runs);
        warnings.append(&mut loaded.warnings);
    }
    (runs, warnings)
}

/// Runs in another order than the manifest's, rows of runs mixed, and a fault in the second run.
#[test]
fn runs_are_found_one_at_a_time_wherever_their_rows_are() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let robot = "format = 1\n[robot]\nleft_wheel_diameter_m = 0.1\nright_wheel_diameter_m = 0.1\nwheel_separation_m = 0.3\n\
                 ticks_per_rev = 500\ncounter_bits = 16\n";
    let runs: String = ["a", "b", "c"].map(|id| format!("[[run]]\nid = \"{id}\"\n")).concat();
    std::fs::write(temp.path().join("dataset.toml"), robot.to_owned() + &runs).expect("written");
    let truth = "run,t_s,x_m,y_m,theta_rad\nb,0,1,0,0\nc,0,2,0,0\na,0,3,0,0\n";
    std::fs::write(temp.path().join("truth.csv"), truth).expect("written");
    let rows = |run: &str| (0..5000).map(|k| format!("{run},{k},{},{}\n", 7 * k % 65_536, k)).collect::<String>();
    let (a, b, c) = (rows("a"), rows("b"), rows("c"));
    let interleaved: String = a.lines().zip(b.lines()).flat_map(|(a, b)| [a, "\n", b, "\n"]).collect();
    for table in [a.clone() + &b + &c, c.clone() + &a + &b, interleaved + &c] {
        std::fs::write(temp.path().join("odometry.csv"), format!("run,t_s,left_ticks,right_ticks\n{table}"))
            .expect("written");
        assert_eq!(run_by_run(temp.path()).0, read(temp.path()).expect("readable").dataset.runs);
    }
    let faulty = format!("run,t_s,left_ticks,right_ticks\n{a}b,0,1,1\nb,1,x,1\n{c}");
    std::fs::write(temp.path().join("odometry.csv"), faulty).expect("written");
    let found: Vec<_> = RunByRun::open(temp.path()).expect("readable").map(|loaded| loaded.map(|_| ())).collect();
    let expected = read(temp.path()).expect_err("a fault").to_string();
    assert!(matches!(&found[..], [Ok(()), Err(error)] if error.to_string() == expected), "{found:?}");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 256, failure_persistence: None, ..ProptestConfig::default() })]
    #[test]
    fn reading_undoes_writing(dataset in datasets()) {
        let temp = tempfile::tempdir().expect("a temporary folder");
        let dir = temp.path().join("set");
        write(&dataset, &dir, Existing::Refuse).expect("written");
        let loaded = read(&dir).expect("readable");
        prop_assert_eq!(&loaded.dataset, &dataset);
        // Equality takes −0 for 0; the text of a number does not.
        prop_assert_eq!(format!("{:?}", loaded.dataset), format!("{dataset:?}"));
        let (runs, warnings) = run_by_run(&dir);
        prop_assert_eq!(format!("{runs:?}"), format!("{:?}", dataset.runs));
        prop_assert_eq!(&warnings, &loaded.warnings);
        // And again, over itself.
        write(&loaded.dataset, &dir, Existing::ReplaceDataset).expect("replaced");
        prop_assert_eq!(read(&dir).expect("readable"), loaded);
    }
}

#[test]
fn a_known_counter_width_survives_and_unwraps_once() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    std::fs::write(
        temp.path().join("dataset.toml"),
        "format = 1\n[robot]\nleft_wheel_diameter_m = 0.1\nright_wheel_diameter_m = 0.1\nwheel_separation_m = 0.3\n\
         ticks_per_rev = 500\ncounter_bits = 16\n[[run]]\nid = \"a\"\n",
    )
    .expect("written");
    std::fs::write(
        temp.path().join("odometry.csv"),
        "run,t_s,left_ticks,right_ticks\na,0,65500,10\na,1,65530,-32768\na,2,24,32760\n",
    )
    .expect("written");
    std::fs::write(temp.path().join("truth.csv"), "run,t_s,x_m,y_m,theta_rad\na,0,0,0,0\n").expect("written");
    let loaded = read(temp.path()).expect("readable");
    assert_eq!(
        loaded.dataset.runs[0].odometry.wheels,
        // 10 → −32768 is −32778 = +32758 modulo 65536; −32768 → 32760 is −8.
        WheelLog::Ticks(Wheels { left: vec![65_500, 65_530, 65_560], right: vec![10, 32_768, 32_760] })
    );
    assert!(loaded.warnings.is_empty());
    let again = temp.path().join("again");
    write(&loaded.dataset, &again, Existing::Refuse).expect("written");
    assert_eq!(read(&again).expect("readable"), loaded);
}
