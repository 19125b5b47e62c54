"""The fit against ordinary least squares, scipy on the same posterior, and simulated truth."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import least_squares

from tests.support.rigs import STANDOFFS_MM, World, prior, thesis_rig
from workbench.calibration.data.spot_rows import observations_of_rows
from workbench.calibration.estimation.fit import CalibrationFit, _check, data_share, fit
from workbench.calibration.model.parameters import Parameter, ParameterTable
from workbench.calibration.verdict.assessment import derive, determined_by
from workbench.model.captures import load_captures
from workbench.model.errors import BadInputError, LimitFailedError
from workbench.model.rig import Rig, load_rig

ROOT = Path(__file__).parents[4]
SEEDS = (1, 2, 3)


def value(result: CalibrationFit, name: str) -> float:
    return float(result.values[[p.name for p in result.table.parameters].index(name)])


def deviation(result: CalibrationFit, name: str) -> float:
    return float(result.sd[[p.name for p in result.table.parameters].index(name)])


class TestWebcam:
    """Real readings of somebody's webcam and laser pointer, against ordinary least squares."""

    @pytest.fixture
    def rig(self) -> Rig:
        return load_rig(ROOT / "rigs/webcam-laser.yaml")

    @staticmethod
    def fitted(rig: Rig) -> CalibrationFit:
        return fit(rig, *observations_of_rows(rig, load_captures(ROOT / "data/webcam-laser-rows.csv")))

    def test_product_and_infinity_are_those_of_ordinary_least_squares(self, rig: Rig) -> None:
        result = self.fitted(rig)
        (derived,) = derive(result)
        z, v = np.loadtxt(ROOT / "data/webcam-laser-rows.csv", delimiter=",", skiprows=1, usecols=(1, 4)).T
        design = np.stack([np.ones_like(z), 1 / z], axis=1)
        (infinity, slope), square, *_ = np.linalg.lstsq(design, v)
        sd = np.sqrt(np.diag(np.linalg.inv(design.T @ design)) * square[0] / (len(v) - 2))
        # The wide priors pull by less than a hundredth of the standard deviation.
        assert derived.f_b_px_mm == pytest.approx(-slope, abs=0.01 * sd[1])
        assert derived.infinity_px == pytest.approx(infinity, abs=0.01 * sd[0])
        assert (derived.f_b_sd, derived.infinity_sd) == pytest.approx((sd[1], sd[0]), rel=1e-3)
        assert result.rms_px == pytest.approx(np.sqrt(square[0] / len(v)), rel=1e-4)

    def test_the_published_figures(self, rig: Rig) -> None:
        result = self.fitted(rig)
        (derived,) = derive(result)
        assert round(derived.f_b_px_mm, -1) == 32480
        assert (round(derived.f_b_sd), round(derived.infinity_px, 1)) == (185, 203.6)
        assert (round(derived.infinity_sd, 1), round(result.rms_px, 2)) == (0.5, 0.60)

    def test_scatter_beyond_rounding_is_found_and_carried_over(self, rig: Rig) -> None:
        result = self.fitted(rig)
        assert result.degrees_of_freedom == pytest.approx(7.0, abs=0.01)  # 9 rows, a line's 2 parameters
        assert result.noise_scale == pytest.approx(0.685 / 0.289, rel=2e-3)

    @pytest.mark.parametrize(("f_px", "y_mm"), [(500.0, -80.0), (900.0, -40.0)])
    def test_the_product_does_not_depend_on_where_the_priors_stand(
        self, rig: Rig, f_px: float, y_mm: float
    ) -> None:
        camera = rig.camera.model_copy(update={"f_px": prior(f_px, 0.3 * f_px)})
        laser = rig.lasers[0].model_copy(update={"y_mm": prior(y_mm, 0.3 * abs(y_mm))})
        other = self.fitted(rig.model_copy(update={"camera": camera, "lasers": (laser,)}))
        (a,), (b,) = derive(self.fitted(rig)), derive(other)
        assert abs(a.f_b_px_mm - b.f_b_px_mm) < 0.03 * a.f_b_sd
        assert abs(value(other, "f_px") - value(self.fitted(rig), "f_px")) > 50  # but the factors do

    def test_nobody_is_told_a_focal_length(self, rig: Rig) -> None:
        result = self.fitted(rig)
        names = [p.name for p in result.table.parameters]
        assert result.data_share[names.index("f_px")] < 1e-3
        assert result.data_share[names.index("1.y_mm")] < 1e-3
        assert determined_by(result)[names.index("f_px")] == "joint"
        assert determined_by(result)[names.index("cx_px")] == "prior"


@pytest.mark.parametrize("seed", SEEDS)
def test_the_optimum_is_scipy_s(seed: int) -> None:
    """The same posterior written again with OpenCV's lens and solved by scipy from the same start."""
    rig = thesis_rig()
    observations = World(rig, seed).observations(repeats=1)
    result = fit(rig, observations)
    table, cells = result.table, result.cells
    names = [p.name for p in table.parameters]
    model = World(rig, seed)

    def residuals(y: np.ndarray) -> np.ndarray:
        values = dict(zip(names, table.prior_mean + table.prior_sd * y, strict=True))
        model.values = values
        data = []
        for n, (laser, placement) in enumerate(zip(cells.laser, cells.placement, strict=True)):
            key, s = cells.placements[placement].key, cells.placements[placement].standoff_mm
            z0 = s * (1 + values["ruler_scale"]) + values[f"{key}.error_mm"] + values["offset_mm"]
            tilts = np.arctan([values[f"{key}.slope_x"], values[f"{key}.slope_y"]])
            pixel = model.pixel(rig.laser_ids[laser], z0, *(tilts + model.common_tilt))
            data.append((pixel - cells.position_px[n]) / (result.noise_scale * cells.sd_px[n]))
        return np.concatenate([np.ravel(data), y])

    start = (result.values - table.prior_mean)[table.free] / table.prior_sd[table.free]
    full = np.zeros(len(names))

    def free_residuals(y: np.ndarray) -> np.ndarray:
        full[table.free] = y
        return residuals(full)

    found = least_squares(free_residuals, np.zeros_like(start), x_scale=1.0, xtol=1e-12, ftol=1e-12)
    posterior_sd = result.sd[table.free] / table.prior_sd[table.free]
    np.testing.assert_allclose(found.x / posterior_sd, start / posterior_sd, atol=1e-3)
    jacobian = np.asarray(found.jac, float)
    covariance = np.linalg.inv(jacobian.T @ jacobian)
    np.testing.assert_allclose(np.sqrt(np.diag(covariance)), posterior_sd, rtol=1e-3)


def test_the_truth_lies_where_the_covariance_says() -> None:
    """40 rigs drawn from the tolerances: errors whitened by the whole covariance are standard normal."""
    rig = thesis_rig()
    distance2, count = 0.0, 0
    for seed in range(100, 140):
        world = World(rig, seed)
        result = fit(rig, world.observations())
        free = result.table.free[result.table.free < result.sensor.stop]
        names = [result.table.parameters[i].name for i in free]
        error = result.values[free] - np.array([world.values[name] for name in names])
        distance2 += float(error @ np.linalg.solve(result.covariance[np.ix_(free, free)], error))
        count += len(free)
    # Chi-square of 40 x 25 degrees of freedom: its mean square is known to sqrt(2 / 1000) = 4.5 %. Deviations
    # stated 10 % too large or too small would show as 0.83 or 1.23.
    assert distance2 / count == pytest.approx(1.0, abs=3.5 * np.sqrt(2 / count))


@pytest.mark.parametrize("seed", SEEDS)
def test_a_drift_with_a_prior_is_found_where_standoffs_are_shuffled(seed: int) -> None:
    spread = prior(0.0, 1.0)
    bench = thesis_rig().bench.model_copy(update={"drift_u_px": spread, "drift_v_px": spread})
    rig = thesis_rig().model_copy(update={"bench": bench})
    world = World(rig, seed)
    shuffled = np.random.default_rng(seed).permutation(STANDOFFS_MM).tolist()
    result = fit(rig, world.observations(tuple(shuffled)))
    for name in ("drift_u_px", "drift_v_px"):
        assert deviation(result, name) < 0.2
        assert abs(value(result, name) - world.values[name]) < 4 * deviation(result, name)


@pytest.mark.parametrize("seed", SEEDS)
def test_a_flat_does_not_give_the_focal_length(seed: int) -> None:
    result = fit(thesis_rig(), World(thesis_rig(), seed).observations())
    names = [p.name for p in result.table.parameters]
    # Sharp by the calliper on four baselines, not by the data.
    assert deviation(result, "f_px") < 0.1 * 26.7
    assert result.data_share[names.index("f_px")] < 0.1
    assert determined_by(result)[names.index("f_px")] == "joint"
    assert result.data_share[names.index("ruler_scale")] < 0.01
    # What ranging needs is determined: see the sensor's tests for the ranges themselves.
    for derived in derive(result):
        assert derived.f_b_sd < 0.002 * derived.f_b_px_mm
    assert result.noise_scale == 1.0


def test_share_of_a_parameter_seen_directly() -> None:
    """One measurement of sd 0.5 of a parameter of prior sd 1: information 4 against 1."""
    table = ParameterTable((Parameter("a", "1", prior(0.0, 1.0), "sensor"),))
    assert data_share(np.array([[2.0]]), table)[0] == pytest.approx(4 / 5, rel=1e-5)


def test_share_of_two_parameters_seen_only_as_a_sum() -> None:
    table = ParameterTable(tuple(Parameter(n, "1", prior(0.0, 1.0), "sensor") for n in "ab"))
    assert data_share(np.array([[100.0, 100.0]]), table).max() < 1e-5


def test_a_placement_s_error_counts_as_noise_of_the_data() -> None:
    """Variance 1 of the placement on top of 1 of the measurement: information 1/2 against 1."""
    table = ParameterTable(
        (
            Parameter("a", "1", prior(0.0, 1.0), "sensor"),
            Parameter("p.error_mm", "mm", prior(0.0, 1.0), "placement"),
        )
    )
    assert data_share(np.array([[1.0, 1.0]]), table)[0] == pytest.approx(1 / 3, rel=1e-5)


def test_more_repeats_at_one_placement_do_not_wash_out_its_error() -> None:
    rig = thesis_rig(speckle_px=0.0)
    one = fit(rig, World(rig, 5).observations((200.0, 400.0, 800.0), repeats=2))
    many = fit(rig, World(rig, 5).observations((200.0, 400.0, 800.0), repeats=200))
    # 100 times the pictures; were they independent the offset's sd would fall tenfold.
    assert deviation(many, "offset_mm") > 0.5 * deviation(one, "offset_mm")


def test_what_captures_state_of_a_placement_replaces_the_rig_s_prior() -> None:
    rig = thesis_rig()
    observations = World(rig, 1).observations(repeats=1)
    stated = [replace(s, standoff_sd_mm=0.4, yaw_deg=2.0) for s in observations]
    result = fit(rig, stated)
    by_name = {p.name: p.prior for p in result.table.parameters}
    assert by_name["125.error_mm"].sd == 0.4 * result.placement_scale
    slope = np.tan(np.radians(2.0))
    assert by_name["125.slope_x"].value == pytest.approx(slope)
    assert by_name["125.slope_x"].sd == pytest.approx(np.radians(0.5) * (1 + slope**2))


def test_a_laser_unknown_to_the_rig() -> None:
    rig = thesis_rig()
    observation = replace(World(rig, 1).observations()[0], laser_id="L9", source="row 7")
    with pytest.raises(BadInputError, match=r"row 7: laser_id: expected one of L1.*got L9"):
        fit(rig, [observation])


def test_nothing_to_fit() -> None:
    with pytest.raises(BadInputError):
        fit(thesis_rig(), [])


def test_standoffs_are_named_in_the_residuals() -> None:
    rig = thesis_rig()
    result = fit(rig, World(rig, 1).observations())
    assert {p.standoff_mm for p in result.cells.placements} == set(STANDOFFS_MM)
    assert result.residual_px.shape == (len(result.cells.laser), 2)
    assert result.rms_px < 0.1


def test_a_target_behind_the_pinhole() -> None:
    rig = thesis_rig()
    bench = rig.bench.model_copy(update={"offset_mm": prior(-300.0, 5.0)})
    with pytest.raises(BadInputError, match=r"125 mm.*-175 mm"):
        fit(rig.model_copy(update={"bench": bench}), World(rig, 1).observations(repeats=1))


def test_the_depth_of_a_target_includes_the_scale_of_the_ruler() -> None:
    """125 mm on a ruler whose millimetres are 1.2 mm, before a pinhole 149 mm in front of the plane: 1 mm."""
    rig = thesis_rig()
    observations = World(rig, 1).observations(repeats=1)
    for offset_mm, is_behind in ((-149.0, False), (-151.0, True)):
        bench = rig.bench.model_copy(
            update={"offset_mm": prior(offset_mm, 5.0), "ruler_scale": prior(0.2, 0.0)}
        )
        scaled = rig.model_copy(update={"bench": bench})
        if is_behind:
            with pytest.raises(BadInputError, match=r"125 mm.*-1 mm"):
                _check(scaled, observations)
        else:
            _check(scaled, observations)


def test_positions_that_contradict_everything_are_said_to() -> None:
    rig = thesis_rig()
    wild = [replace(s, v_px=1e200) for s in World(rig, 1).observations(repeats=1)]
    with pytest.raises(LimitFailedError, match="finite result"):
        fit(rig, wild)


def test_repeats_that_scatter_more_than_stated_are_believed() -> None:
    """Noise ten times the stated: the means' deviations and the exported spot's must follow."""
    rig = thesis_rig(noise_px=0.3)
    stated = thesis_rig(noise_px=0.03)
    result = fit(stated, World(rig, 1).observations(repeats=20))
    # 44 cells of 20 repeats and 2 coordinates: the ratio is known to 1 / sqrt(2 x 1672) = 1.7 %.
    assert result.cells.repeat_scale == pytest.approx(10.0, rel=0.06)
    np.testing.assert_allclose(result.cells.sd_px, np.hypot(0.3 / np.sqrt(20), 0.04), rtol=0.06)
    assert result.noise_scale == 1.0
