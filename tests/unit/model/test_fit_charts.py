"""Charts of a fit."""

from __future__ import annotations

from tests.viewer.session import BAD, LASERS, STANDOFFS, a_fit
from workbench.model.fit_charts import residual_chart


def test_residuals_have_a_series_for_each_laser() -> None:
    fit = a_fit()
    residuals = tuple(one.model_copy(update={"v_sd_px": 0.5, "u_sd_px": 0.1}) for one in fit.residuals)
    fit = fit.model_copy(update={"residuals": residuals})
    chart = residual_chart(fit, "v")
    assert (chart.x.unit, chart.x.scale, chart.y.unit) == ("mm", "log", "px")
    assert [series.name for series in chart.series] == list(LASERS)
    for series in chart.series:
        own = [one for one in fit.residuals if one.laser_id == series.name]
        assert series.x == STANDOFFS
        assert series.y == tuple(one.v_px for one in own)
        assert series.sd == series.expected_sd == tuple(one.v_sd_px for one in own)


def test_the_residual_beyond_its_sd_is_the_outlier() -> None:
    chart = residual_chart(a_fit(), "u")
    found = [(s.name, s.x[i]) for s in chart.series for i in range(len(s.x)) if s.is_outlier(i)]
    assert found == [BAD]


def test_an_axis_that_was_not_measured_is_empty() -> None:
    fit = a_fit()
    residuals = tuple(one.model_copy(update={"v_px": None, "v_sd_px": None}) for one in fit.residuals)
    one_axis = fit.model_copy(update={"residuals": residuals})
    assert residual_chart(one_axis, "v").is_empty
    assert not residual_chart(one_axis, "u").is_empty
