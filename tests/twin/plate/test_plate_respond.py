"""The response of a plate: closed forms, balances and the equality of routes; modal tables."""

from __future__ import annotations

import math

import numpy as np
import pytest
from pyroshock.twin.plate.modal import ModalPlate
from pyroshock.twin.plate.response import PlateResponse, Recursion, kept_below, respond
from pyroshock.twin.plate.table import modal_plate_from_table, read_modal_table


def plate(frequency_hz, damping=0.01, seed=0, sensors=2):
    frequency = np.asarray(frequency_hz, dtype=float)
    rng = np.random.default_rng(seed)
    return ModalPlate(
        frequency_hz=frequency,
        damping_ratio=np.full(frequency.size, damping),
        shape_impact=rng.normal(size=(1, frequency.size)),
        shapes=rng.normal(size=(sensors, frequency.size)),
        impact_points=("#1",),
        sensors=tuple("abcd"[:sensors]),
    )


def oscillator(frequency_hz, damping):
    one = np.ones((1, 1))
    return ModalPlate(np.array([frequency_hz]), np.array([damping]), one, one, ("#1",), ("a",))


def half_sine(samples, width, step_s):
    time = step_s * np.arange(samples)
    return np.where(time < width, np.sin(np.pi * time / width), 0.0)


@pytest.mark.parametrize("damping", [0.0, 0.05, 0.7])
@pytest.mark.parametrize("frequency_hz", [0.01, 37.0, 4000.0])
def test_a_step_of_force_has_its_closed_form(frequency_hz, damping):
    step_s, n = 1e-4, 4000
    time, omega = step_s * np.arange(n), 2 * np.pi * frequency_hz
    damped = omega * np.sqrt(1 - damping**2)
    # q'' after a unit step: exp(-zeta omega t) (cos - zeta omega / omega_d sin).
    exact = np.exp(-damping * omega * time) * (
        np.cos(damped * time) - damping * omega / damped * np.sin(damped * time)
    )
    found = respond(oscillator(frequency_hz, damping), np.ones(n), step_s)[0]
    np.testing.assert_allclose(found, exact, atol=1e-10)


def test_half_sine_into_one_mode_converges_to_its_closed_form():
    frequency_hz, width = 300.0, 2e-3
    omega, drive = 2 * np.pi * frequency_hz, np.pi / width
    errors = []
    for n in (200, 400, 800):
        step_s = width / (n - 1)
        time = step_s * np.arange(n)
        exact = (
            drive
            * (omega * np.sin(omega * time) - drive * np.sin(drive * time))
            / (omega**2 - drive**2)
        )
        errors.append(
            np.max(
                np.abs(
                    respond(oscillator(frequency_hz, 0.0), np.sin(drive * time), step_s)[0] - exact
                )
            )
        )
    # The force is straight where the sine is not: second order.
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2, abs=0.1)
    assert np.log2(errors[1] / errors[2]) == pytest.approx(2, abs=0.1)
    assert errors[-1] < 1e-5


def test_a_rigid_plate_moves_as_newton_says_and_slow_modes_lose_no_precision():
    mass = 7.5
    shape = np.full((1, 1), mass**-0.5)
    rigid = ModalPlate(np.zeros(1), np.array([0.3]), shape, shape, ("#1",), ("a",))
    force = np.random.default_rng(1).normal(size=50)
    np.testing.assert_allclose(respond(rigid, force, 1e-4)[0], force / mass, rtol=1e-14)
    # omega dt = 6e-9: a two-step recursion would have lost all of its digits. The answer is F -
    # (omega^2 q + ...) = F.
    acceleration = respond(oscillator(1e-3, 0.01), np.ones(1000), 1e-6)[0]
    time, omega = 1e-6 * np.arange(1000), 2e-3 * np.pi
    np.testing.assert_allclose(
        1 - acceleration,
        0.02 * omega * time + (omega * time) ** 2 * (0.5 - 2e-4),
        rtol=1e-3,
        atol=1e-15,
    )


def test_solve_ivp_agrees():
    from scipy.integrate import solve_ivp

    few = plate([0.0, 200.0, 450.0, 1300.0], damping=0.02)
    step_s, n = 5e-5, 300
    force = half_sine(n, 2e-3, step_s)
    time, omega, zeta = step_s * np.arange(n), 2 * np.pi * few.frequency_hz, few.damping_ratio

    def motion(t, y):
        q, v = np.split(y, 2)
        return np.concatenate(
            [
                v,
                few.shape_impact[0] * np.interp(t, time, force)
                - 2 * zeta * omega * v
                - omega**2 * q,
            ]
        )

    peer = solve_ivp(
        motion, (0, time[-1]), np.zeros(8), t_eval=time, rtol=1e-10, atol=1e-14, max_step=step_s
    )
    exact = few.shapes @ np.array([motion(t, y)[4:] for t, y in zip(time, peer.y.T, strict=True)]).T
    found = respond(few, force, step_s)
    assert np.max(np.abs(found - exact)) < 1e-6 * np.max(np.abs(exact))


def test_a_finer_grid_changes_nothing_and_hit_and_sensor_change_places():
    """A force may be there at one sample only; sensors are chosen by name."""
    many = plate(np.linspace(0, 4000, 40), sensors=3)
    force = np.random.default_rng(2).normal(size=200)
    fine = np.interp(np.arange(0, 199.01, 0.25), np.arange(200), force)
    coarse, refined = respond(many, force, 1e-4), respond(many, fine, 2.5e-5)
    np.testing.assert_allclose(refined[:, ::4], coarse, atol=1e-11 * np.abs(coarse).max())
    np.testing.assert_array_equal(respond(many, force, 1e-4, sensors=("c", "a")), coarse[[2, 0]])
    knock = np.zeros((2, 64))
    knock[0, 0], knock[1, 1] = 2.5, -1.0
    few = plate([100.0, 700.0])
    exact = respond(few, knock, 1e-4)
    accelerations = PlateResponse.of(few, "#1", None, 1e-4, 64).accelerations(knock)
    np.testing.assert_allclose(accelerations, exact, atol=1e-12 * np.abs(exact).max())
    there = plate(np.linspace(50, 4000, 33), sensors=1)
    back = ModalPlate(
        there.frequency_hz, there.damping_ratio, there.shapes, there.shape_impact, ("#1",), ("a",)
    )
    half = half_sine(400, 1e-3, 1e-4)
    np.testing.assert_allclose(
        respond(there, half, 1e-4), respond(back, half, 1e-4), rtol=1e-12, atol=1e-12
    )


def test_work_becomes_motion_strain_and_heat():
    one = oscillator(500.0, 0.03)
    step_s, n = 2e-6, 4000
    force, omega = half_sine(n, 1e-3, step_s), 2 * np.pi * 500.0
    acceleration = respond(one, force, step_s)[0]
    velocity = step_s * np.concatenate([[0], np.cumsum((acceleration[1:] + acceleration[:-1]) / 2)])
    q = step_s * np.concatenate([[0], np.cumsum((velocity[1:] + velocity[:-1]) / 2)])
    work = np.trapezoid(force * velocity, dx=step_s)
    heat = np.trapezoid(2 * 0.03 * omega * velocity**2, dx=step_s)
    assert work == pytest.approx(velocity[-1] ** 2 / 2 + (omega * q[-1]) ** 2 / 2 + heat, rel=1e-4)


@pytest.mark.parametrize("angle", [1e-4, 3e-3, 0.0199, 0.0201, 0.3])
def test_gains_of_a_slow_mode_are_exact(angle):
    # (exp(x) - 1) / x and (exp(x) - 1 - x) / x^2 as sums of twenty terms, which lose no digit at
    # any of these.
    step_s, damping = 1e-5, 0.02
    omega = angle / step_s
    one = Recursion.of(np.array([omega / (2 * np.pi)]), np.array([damping]), step_s)
    pole = omega * complex(-damping, math.sqrt(1 - damping**2))
    gain = pole**2 / pole.imag * step_s
    level, slope = (
        sum((pole * step_s) ** k / math.factorial(k + more) for k in range(20)) for more in (1, 2)
    )
    # Six terms below 0.02; above, a difference of nearly equal numbers.
    assert abs((one.before[0] + one.after[0]) / gain - level) < 1e-15 + angle**6 / 4000
    assert abs(one.after[0] / gain - slope) < (4e-15 if angle < 0.02 else 4e-15 / angle)


@pytest.mark.parametrize("begin", [0.0, 1.7])
def test_convolved_pulses_equal_the_recursion(begin):
    many = plate(np.concatenate([[0, 0, 0], np.linspace(60, 9000, 150)]), damping=0.004)
    forces = np.zeros((5, 3000))
    forces[:, :120] = np.random.default_rng(3).normal(size=(5, 120))
    forces[:, 0], forces[:, 119] = begin, 0.0
    exact = respond(many, forces, 4e-5)
    response = PlateResponse.of(many, "#1", None, 4e-5, 3000)
    found = response.accelerations(forces[:, :120])
    assert np.max(np.abs(found - exact)) < 1e-10 * np.max(np.abs(exact))
    np.testing.assert_array_equal(response.accelerations(forces[2, :120]).shape, (2, 3000))


def test_modes_beyond_half_the_sampling_rate_and_wrong_forces_are_refused():
    many = plate([100.0, 6000.0])
    with pytest.raises(ValueError, match=r"6000 Hz is beyond half the sampling rate, 5000 Hz"):
        respond(many, np.zeros(10), 1e-4)
    assert respond(kept_below(many, 5000.0), np.zeros(10), 1e-4).shape == (2, 10)
    assert kept_below(many, 6000.0).frequency_hz.tolist() == [100.0]
    assert respond(oscillator(0.01, 0.0), np.ones(3), 20.0).shape == (1, 3)
    with pytest.raises(ValueError, match=r"0\.01 Hz is beyond half"):
        respond(oscillator(0.01, 0.0), np.ones(3), 50.0)
    many = plate([100.0])
    with pytest.raises(ValueError, match="finite"):
        respond(many, np.array([0.0, np.nan]), 1e-4)
    with pytest.raises(ValueError, match="step_s"):
        respond(many, np.zeros(3), 0.0)
    with pytest.raises(ValueError, match="p up to 8"):
        PlateResponse.of(many, "#1", None, 1e-4, 8).accelerations(np.zeros(9))
    with pytest.raises(ValueError, match="samples = 1: expected 2 or more"):
        PlateResponse.of(many, "#1", None, 1e-4, 1)
    assert PlateResponse.of(many, "#1", None, 1e-4, 2).accelerations(np.ones(2)).shape == (2, 2)


@pytest.mark.parametrize(
    ("frequency_hz", "damping_ratio", "message"),
    [
        ([-0.5, 3.0], [0.1, 0.1], "0 or more, in rising order"),
        ([3.0, 2.5], [0.1, 0.1], "0 or more, in rising order"),
        ([2.0, 3.0], [0.1, -0.5], "0 to below 1"),
        ([2.0, 3.0], [0.1, 1.0], "damping_ratio up to 1"),
        ([2.0, 3.0], [0.1], "expected \\(2,\\)"),
    ],
)
def test_modes_that_cannot_be_are_refused(frequency_hz, damping_ratio, message):
    shapes = np.ones((1, 2))
    with pytest.raises(ValueError, match=message):
        ModalPlate(np.array(frequency_hz), np.array(damping_ratio), shapes, shapes, ("#1",), ("a",))


HEADER = "mode,frequency_hz,damping_ratio,shape_impact,shape_a,shape_impact_2,shape_b"


def written(folder, text):
    path = folder / "plate_modes.csv"
    path.write_text(text, encoding="utf-8")
    return path


def test_a_table_is_read_in_rising_order_and_a_german_one_is_the_same(tmp_path):
    plate = read_modal_table(written(tmp_path, f"{HEADER}\n2,300,0.02,1,2,3,4\n1,0,0.01,5,6,7,8\n"))
    np.testing.assert_array_equal(plate.frequency_hz, [0, 300])
    np.testing.assert_array_equal(plate.damping_ratio, [0.01, 0.02])
    np.testing.assert_array_equal(plate.shape_impact, [[5, 1], [7, 3]])
    np.testing.assert_array_equal(plate.shapes, [[6, 2], [8, 4]])
    assert plate.impact_points == ("#1", "#2")
    assert plate.sensors == ("a", "b")
    german = f"{HEADER}\n2,300,0.02,1.5,2,3,4.25\n".replace(",", ";").replace(".", ",")
    plate = read_modal_table(written(tmp_path, german))
    assert (plate.frequency_hz[0], plate.damping_ratio[0], plate.shape_impact[0, 0]) == (
        300,
        0.02,
        1.5,
    )
    assert plate.shapes[1, 0] == 4.25


def test_an_example_is_read(examples):
    path = examples / "plate-damping" / "plate_modes.csv"
    rows = np.genfromtxt(path, delimiter=",", names=True)
    plate = read_modal_table(path)
    assert plate.frequency_hz.tolist() == rows["frequency_hz"].tolist()
    assert plate.sensors == ("acceleration_1", "acceleration_2")
    assert plate.shape_impact[0].tolist() == rows["shape_impact"].tolist()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "frequency_hz,damping_ratio,shape_impact,shape_a\n5,0.1,x,1\n",
            r"csv: row 2, column 'shape_impact': 'x'",
        ),
        (
            "frequency_hz,damping_ratio,shape_impact,shape_a\n5,1.1,1,1\n",
            r"row 2, column 'damping_ratio': '1.1'",
        ),
        (
            "frequency_hz,damping_ratio,shape_impact,shape_a\n-5,0,1,1\n",
            r"row 2, column 'frequency_hz': '-5'",
        ),
        (
            "frequency_hz,damping_ratio,shape_impact,shape_a\n5,0,inf,1\n",
            r"row 2, column 'shape_impact': 'inf'",
        ),
        ("frequency_hz,damping_ratio,shape_impact,shape_a\n5,0,1\n", r"row 2: 3 cells; expected 4"),
        ("frequency_hz,damping_ratio,shape_impact\n5,0,1\n", r"csv: no column 'shape_CHANNEL'"),
        ("frequency_hz,shape_impact,shape_a\n5,0,1\n", r"csv: no column 'damping_ratio'"),
        (
            "damping_ratio,shape_impact,shape_a\n0,1,1\n",
            r"csv: no column 'frequency_hz'; there are: damping_ratio, ",
        ),
        ("frequency_hz,damping_ratio,shape_a\n5,0,1\n", r"csv: no column 'shape_impact'"),
        (
            "frequency_hz,damping_ratio,shape_impact,shape_a\n",
            r"csv: no modes below the header; expected at least one",
        ),
        (
            "frequency_hz,damping_ratio,shape_impact,shape_a,shape_a\n5,0,1,1,1\n",
            r"csv: column 'shape_a' stands twice",
        ),
        (f"{HEADER}\n1,5,0,1,1,1,1\n1,6,0,1,1,1,1\n", r"mode 1 stands twice"),
    ],
)
def test_a_refusal_names_the_place(tmp_path, text, message):
    with pytest.raises(ValueError, match=message):
        read_modal_table(written(tmp_path, text))


def test_a_file_that_is_no_text_and_columns_of_unequal_length_are_refused(tmp_path):
    path = tmp_path / "plate_modes.csv"
    path.write_bytes(b"\xff\xfe\x00mode")
    with pytest.raises(ValueError, match=r"plate_modes\.csv: byte 0 is not UTF-8"):
        read_modal_table(path)
    with pytest.raises(FileNotFoundError):
        read_modal_table(tmp_path / "none.csv")
    columns = {
        "frequency_hz": [1.0, 2.0],
        "damping_ratio": [0.1, 0.1],
        "shape_impact": [1.0],
        "shape_a": [1.0, 1.0],
    }
    with pytest.raises(ValueError, match="shape_impact"):
        modal_plate_from_table(columns)
