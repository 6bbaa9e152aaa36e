"""What was found against what was built: `python sizes.py --logs DIR --results results.json`, of make_logs.py and judge.py.

For each fault that has a size in the catalogue, found over built: from the drawing where that says it, from masses, heights and stiffness where a balance of forces does. For robots
with nothing built in, what `lateral_skid` and unlisted terms are, beside what the balances of own_physics.py give.
"""
import argparse
import json
import math
import pathlib

from drives import TIMESTEP_S
from robot import CONTACT_TIME_S, GRAVITY_M_S2, IMPEDANCE

# The speed at which slip in proportion to |v| is compared with a term that has none.
SPEED_M_S = 0.4


def built(fault: str, made: dict) -> dict[tuple[str, str], float]:
    """Sizes by id and parameter, in the catalogue's words."""
    robot, size = made["robot"], made["size"]
    track_m = robot["hub_track_m"] + 2 * robot["crown_offset_m"]
    press = 2 * robot["tyre_stiffness_n_m"] * robot["wheel_radius_m"]
    if fault == "late_truth":
        return {("truth_latency", "delay_s"): size["late_s"]}
    if fault == "marker_offset":
        return {("truth_lever_arm", "lever_x_m"): size["marker_x_m"], ("truth_lever_arm", "lever_y_m"): size["marker_y_m"]}
    if fault == "toe":
        return {("truth_yaw", "yaw_rad"): -size["toe_rad"]}
    if fault == "payload_soft_tyres":
        return {("payload_compression", "common_per_kg"): GRAVITY_M_S2 * (1 - robot["body_com_x_m"] / robot["castor_x_m"]) / 2 / press}
    if fault == "high_centre_of_mass":
        mass_kg, height_m = robot["body_mass_kg"] + 2 * robot["wheel_mass_kg"], robot["wheel_radius_m"] + robot["body_com_z_m"]
        return {("load_transfer", "compression_s2_m"): mass_kg * height_m / press / track_m}
    if fault == "off_centre_wheel":
        return {("wheel_eccentricity", side): size[f"{side}_offset_over_radius"] for side in ("left", "right") if f"{side}_offset_over_radius" in size}
    if fault == "oval_wheel":
        return {("encoder_cycle", side): size[f"{side}_oval"] / 2 for side in ("left", "right") if f"{side}_oval" in size}
    return {}


def value(finding: dict, parameter: str) -> float:
    """A parameter, or the amplitude of a side's sine and cosine."""
    sizes = {name: entry["value"] for name, entry in finding["parameters"].items()}
    if parameter in sizes:
        return sizes[parameter]
    return math.hypot(*(size for name, size in sizes.items() if name.startswith(f"{parameter}_")))


def balances(robot: dict) -> str:
    """What a robot with nothing built in does by its balances of forces (own_physics.py), above the speed of the regularised creep."""
    mass_kg, track_m = robot["body_mass_kg"] + 2 * robot["wheel_mass_kg"], robot["hub_track_m"] + 2 * robot["crown_offset_m"]
    wheel_n = GRAVITY_M_S2 * (robot["body_mass_kg"] * (1 - robot["body_com_x_m"] / robot["castor_x_m"]) / 2 + robot["wheel_mass_kg"])
    slip = mass_kg / (2 * wheel_n * robot["slip_stiffness"])
    skid_s = slip * SPEED_M_S + IMPEDANCE * CONTACT_TIME_S / 2 - TIMESTEP_S / 2
    tail = 2 * robot["body_mass_kg"] * -robot["body_com_x_m"] / (wheel_n * robot["slip_stiffness"] * track_m**2)
    transfer = mass_kg * (robot["wheel_radius_m"] + robot["body_com_z_m"]) / (robot["tyre_stiffness_n_m"] * robot["wheel_radius_m"] * track_m**2)
    return f"skid {1e3 * skid_s:.2f} ms at {SPEED_M_S} m/s; wheels {-slip:+.2e} |v| a; yaw {tail - transfer:+.2e} |v| v omega"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--logs", type=pathlib.Path, required=True)
    parser.add_argument("--results", type=pathlib.Path, required=True)
    arguments = parser.parse_args()
    ratios: dict[tuple[str, str], list[float]] = {}
    for name, row in json.loads(arguments.results.read_text())["logs"].items():
        made = json.loads((arguments.logs / name / "made.json").read_text())
        sizes = built(row["fault"], made)
        for finding in row.get("findings", []):
            for (effect, parameter), size in sizes.items():
                if finding["id"] == effect and finding["parameters"]:
                    ratios.setdefault((row["fault"], parameter), []).append(value(finding, parameter) / size)
        if row["fault"] == "nothing_built_in":
            skids = [f"{1e3 * value(finding, 'skid_s'):.2f} ms" for finding in row["findings"] if finding["id"] == "lateral_skid" and finding["parameters"]]
            terms = [f"{term['channel']} {term['coefficient']:+.2e} {' '.join(term['covariates'])}" for term in (finding["term"] for finding in row["findings"]) if term]
            print(f"{name}: by balances {balances(made['robot'])}; found skid {', '.join(skids) or 'none'}; {'; '.join(terms) or 'no term'}")
    for (fault, parameter), found in sorted(ratios.items()):
        print(f"{fault}, {parameter}: found over built from {min(found):.3f} to {max(found):.3f} in {len(found)}")


if __name__ == "__main__":
    main()
