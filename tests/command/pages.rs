//! report.html of `calibrate`, `evaluate` and `compare`: where it is written, what it shows, and that names
//! of runs stay text.

use std::fs;
use std::path::Path;

use crate::support::{refusal, succeed, usage, workplace};

/// A metre ahead under a run whose name would run a script.
fn hostile(at: &Path) {
    let set = at.join("set");
    fs::create_dir_all(&set).expect("made");
    let toml = "format = 1\n[robot]\nleft_wheel_diameter_m = 0.3183098861837907\nright_wheel_diameter_m = 0.3183098861837907\n\
                wheel_separation_m = 0.3\nticks_per_rev = 1000\n[[run]]\nid = \"</script><script>alert(1)</script><!--\"\n";
    fs::write(set.join("dataset.toml"), toml).expect("written");
    let id = "</script><script>alert(1)</script><!--";
    let odometry = format!("run,t_s,left_ticks,right_ticks\n{id},0,0,0\n{id},1,500,500\n{id},2,1000,1000\n");
    fs::write(set.join("odometry.csv"), odometry).expect("written");
    let truth = format!("run,t_s,x_m,y_m,theta_rad\n{id},0,0,0,0\n{id},1,0.5,0,0\n{id},2,1.0,0.02,0\n");
    fs::write(set.join("truth.csv"), truth).expect("written");
}

fn page(folder: &Path) -> String {
    fs::read_to_string(folder.join("report.html")).expect("a page")
}

#[test]
fn an_evaluation_is_drawn_and_names_of_runs_stay_text() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let at = temp.path();
    hostile(at);
    succeed(at, &["evaluate", "set", "--out-dir", "page"]);
    let page = page(&at.join("page"));
    assert!(!page.contains("<script>alert") && page.contains("&#60;script&#62;alert"));
    // 0.02 m beside after a metre.
    assert!(page.contains("2.000\u{a0}%") && page.contains("yair evaluate set --out-dir page"));
    // A second time the page is replaced.
    succeed(at, &["evaluate", "set", "--out-dir", "page"]);
    assert_eq!(fs::read_dir(at.join("page")).expect("there").count(), 1);
    let refused = refusal(at, &["evaluate", "set", "--out-dir", "set/dataset.toml"]);
    assert!(refused.contains("set/dataset.toml: it is a file, where a folder belongs"), "{refused}");
    assert!(usage(at, &["evaluate", "set", "--out-dir"]).contains("--out-dir"));
}

#[test]
fn a_calibration_has_a_page_beside_its_file_and_a_comparison_has_one() {
    let temp = workplace();
    let at = temp.path();
    succeed(at, &["calibrate", "set", "--method", "direct", "--out", "c.toml", "--out-dir", "page"]);
    let text = page(&at.join("page"));
    for part in ["Left wheel", "Wheel separation", "wheel_separation_m = 0.36", "id=\"path\"", "id=\"drift\""] {
        assert!(text.contains(part), "no {part}");
    }
    assert!(fs::read_to_string(at.join("c.toml")).expect("a calibration").contains("[[methods]]"));
    succeed(at, &["simulate", "paper.toml", "--out", "other", "--trial", "1"]);
    succeed(at, &["compare", "set", "other", "--method", "direct", "--out-dir", "compared"]);
    let compared = page(&at.join("compared"));
    assert!(compared.contains("trained on") && compared.contains("<code>direct</code>"));
}
