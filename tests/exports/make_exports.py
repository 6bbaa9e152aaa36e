"""Writes the drive of tests/ros2/zstd.mcap as other programs export it: Motive, Vicon, PlotJuggler, and an FTC robot's own CSV.

    yair import ros2 tests/ros2/zstd.mcap --out mine --wheel 0.15 --base 0.3
    python3 tests/exports/make_exports.py mine tests/exports

Motive's y is up; Vicon counts frames at 100 Hz, in millimetres, with the rotation as a vector along its axis. The FTC robot logs counts of
8192 a wheel turn and the heading of its IMU in degrees.
"""

import csv
import math
import pathlib
import sys

COUNTS = 8192
VICON_HZ = 100


def rows(file):
    with file.open(newline="") as text:
        return [{key: float(value) for key, value in row.items() if key != "run"} for row in csv.DictReader(text)]


def motive(poses):
    yield "Format Version,1.23,Take Name,drive,Rotation Type,Quaternion,Length Units,Meters\n\n"
    yield ",Type" + ",Rigid Body" * 7 + "\n,Name" + ",robot" * 7 + "\n"
    yield ",," + ",".join(["Rotation"] * 4 + ["Position"] * 3) + "\nFrame,Time (Seconds),X,Y,Z,W,X,Y,Z\n"
    for frame, pose in enumerate(poses):
        sin, cos = math.sin(0.5 * pose["theta_rad"]), math.cos(0.5 * pose["theta_rad"])
        yield f"{frame},{pose['t_s']:.3f},0,{sin:.6f},0,{cos:.6f},{pose['x_m']:.5f},0.1,{-pose['y_m']:.5f}\n"


def vicon(poses):
    yield f"Objects\n{VICON_HZ}\n,,robot:robot,,,,,\nFrame,Sub Frame,RX,RY,RZ,TX,TY,TZ\n,,rad,rad,rad,mm,mm,mm\n"
    for pose in poses:
        turn = math.remainder(pose["theta_rad"], 2 * math.pi)
        frame = 1 + round(VICON_HZ * pose["t_s"])
        yield f"{frame},0,0,0,{turn:.5f},{1e3 * pose['x_m']:.2f},{1e3 * pose['y_m']:.2f},100\n"


def wheels(log):
    yield "time,left_ticks,right_ticks\n"
    for row in log:
        left, right = (round(COUNTS * row[side] / (2 * math.pi)) for side in ("left_rad", "right_rad"))
        yield f"{row['t_s']:.3f},{left},{right}\n"


def plotjuggler(log, poses):
    """One table of all curves: cells are empty where a curve has no value."""
    yield (
        "__time,/joint_states/wheel_left_joint/position,/joint_states/wheel_right_joint/position,"
        "/robot/pose/pose/position/x,/robot/pose/pose/position/y,/robot/pose/pose/orientation/yaw\n"
    )
    seen = {round(1e3 * pose["t_s"]): pose for pose in poses}
    for row in log:
        pose = seen.get(round(1e3 * row["t_s"]))
        values = f"{pose['x_m']:.5f},{pose['y_m']:.5f},{pose['theta_rad']:.6f}" if pose else ",,"
        yield f"{1764000000 + row['t_s']:.3f},{row['left_rad']:.6f},{row['right_rad']:.6f},{values}\n"


def main(dataset, out):
    log, poses = rows(dataset / "odometry.csv"), rows(dataset / "truth.csv")
    for name, lines in [
        ("motive.csv", motive(poses)),
        ("vicon.csv", vicon(poses)),
        ("wheels.csv", wheels(log)),
        ("plotjuggler.csv", plotjuggler(log, poses)),
    ]:
        (out / name).write_text("".join(lines))


main(*map(pathlib.Path, sys.argv[1:]))
