"""``jointlib import`` of what drives record: torques, per cent of a rated value, feed speeds, a second clock."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from test_import_verb import NOISE, TIME, imported, refused, saved

from jointlib.arrays import Array
from jointlib.io.measurement_file import read_measurement, read_records

Z = 40.0 * (1 - np.cos(2 * np.pi * 5 * TIME))


def read(folder: Path) -> dict[str, Array]:
    measurement = read_measurement(folder / "m.measurement.toml")
    (record,) = read_records(measurement, measurement.records)
    return dict(record.channels)


@pytest.mark.parametrize("unit", ["(N·m)", "[Nm]", "[NM]", "[N m]", "/Nm"])
def test_a_torque_is_a_force_over_the_lead_of_a_screw_and_no_nanometres(tmp_path: Path, unit: str) -> None:
    record = saved(tmp_path / "r.csv", f"time [s];position [mm];torque{unit}", Z, NOISE[0])
    refused(tmp_path, str(record), "is a torque; of a screw 2π over its lead (--set channel.torque.sensitivity='628 ")
    imported(tmp_path, f"{record} --set channel.torque.sensitivity='628 N/(N m)'")
    np.testing.assert_allclose(read(tmp_path)["torque"], 628 * np.round(NOISE[0], 6))


def test_per_cent_of_a_rated_force_are_a_force(tmp_path: Path) -> None:
    record = saved(tmp_path / "r.csv", "time [s];position [mm];load [%]", Z, NOISE[0])
    refused(tmp_path, str(record), "is in per cent of a rated value (--set channel.load.sensitivity='24 N/%'")
    imported(tmp_path, f"{record} --set channel.load.sensitivity='24 N/%'")
    np.testing.assert_allclose(read(tmp_path)["load"], 24 * np.round(NOISE[0], 6))


def test_a_feed_speed_is_read_in_metres_a_minute(tmp_path: Path) -> None:
    record = saved(tmp_path / "r.csv", "t in s;Weg in mm;Vorschub in m/min;Kraft in N", Z, 6 * NOISE[1], NOISE[0])
    imported(tmp_path, str(record))
    np.testing.assert_allclose(read(tmp_path)["vorschub"], np.round(6 * NOISE[1], 6) / 60)


def test_of_two_times_the_one_that_rises_evenly_is_the_clock(tmp_path: Path) -> None:
    cycles = 4.0 * np.floor(1e3 * TIME / 4.0)
    columns = (cycles, TIME, Z, NOISE[0])
    record = saved(tmp_path / "r.csv", "t_plc [ms];t_daq [s];x [mm];F [N]", *columns, time=None)
    done = imported(tmp_path, str(record))
    assert "column 't_plc [ms]' is a time that stands still between samples and is left out" in done.out + done.err
    assert set(read(tmp_path)) == {"x", "f"}


def test_an_angle_is_no_length_and_a_heading_ends_in_its_unit(tmp_path: Path) -> None:
    """A joint of a robot: headings of degrees were read as metres, and a temperature as kelvins."""
    columns = (NOISE[0], 50 * Z, NOISE[1], 20 + Z)
    record = saved(tmp_path / "r.csv", "time_s;motor_current_A;q_deg;qd_deg_s;gear_temperature_C", *columns)
    refused(tmp_path, str(record), "motor_current_a does with --set channel.motor_current_a.sensitivity='14.7 N/A'")
    sensed = f"{record} --set channel.motor_current_a.sensitivity='84 N/A'"
    refused(
        tmp_path, sensed, "'q_deg' is an angle (--set channel.q_deg.gain=0.0174533, and .unit=m: at a lever of 1 m)"
    )
    lever = "--set channel.q_deg.unit=m --set channel.q_deg.gain=0.0174533"
    done = imported(tmp_path, f"{sensed} {lever}")
    assert "'qd_deg_s' is an angle (--set channel.qd_deg_s.gain=0.0174533, and .unit=m/s: at a" in done.out + done.err
    found = read(tmp_path)
    np.testing.assert_allclose(found["q_deg"], np.radians(np.round(50 * Z, 6)), rtol=1e-5, atol=1e-7)
    np.testing.assert_allclose(found["motor_current_a"], 84 * np.round(NOISE[0], 6))
    np.testing.assert_allclose(found["gear_temperature_c"], 293.15 + np.round(Z, 6), rtol=1e-6)
