"""Study of lasers of several colours: `python -m tests.proofs.colours`.

The thesis fires each laser alone where spots are missing. With lasers of three colours and a camera of three
sensors (red, green, blue) one pair of frames may do. All ways read the same scenes on the virtual bench. Some
beams meet an object, the others a wall, and some are lost. The workbench itself has no colour camera.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tests.bench.sensors import calibration_of
from tests.support.stored_output import store
from workbench.emulator.scene import BenchScene
from workbench.emulator.sensor import ImageSensor
from workbench.emulator.spec import EmulatorSpec, emulator_spec
from workbench.emulator.spot import ImageFormat, SpotImage
from workbench.emulator.truth import Truth, draw_truth
from workbench.model.arrays import FloatArray, Image
from workbench.model.rig import Rig, load_rig
from workbench.model.spot import Spot
from workbench.model.target import Placement
from workbench.ranging.acquire import acquire
from workbench.ranging.alone import spots_on_line
from workbench.ranging.ranger import Ranger, Reading, spot_arrays
from workbench.spots import Finding, find_spots

ROOT = Path(__file__).parents[2]
COLOURS = (650, 532, 450)
"""Wavelengths, nm; each has a sensor that sees it best."""
COLOUR_OF = {"L1": 0, "L2": 1, "L3": 2, "L4": 0}
"""Colour of each laser. Two of one colour are on different sides of the camera."""
RESPONSE = np.array([[1.0, 0.12, 0.05], [0.10, 1.0, 0.15], [0.04, 0.20, 1.0]])
"""Prior mean of the response of the sensors (rows) to the colours (columns), relative to the best sensor."""
RESPONSE_SD = 0.05
BAND_RATIO = 9.0
"""Room light through a colour filter of some 100 nm instead of a band-pass filter of 11 nm."""
FRAMES_PER_S, FRAMES_OF_PAIR = 30, 2
READINGS = 200
FIRED = 10
"""Captures of each laser alone by which the response is measured."""
LOST, NEAR_MM, WALL_MM = 0.1, (300.0, 1500.0), (1500.0, 4500.0)
"""Share of lost beams; distances of object and wall."""
THESIS, OURS, COLOURED = "thesis: alone unless all seen", "workbench: alone where ambiguous", "three colours"
HALF_WINDOW = 6
LEAST_MARGIN = 9.0
"""Difference of chi-square between the best colour and the next from which a spot has a colour."""
WRONG = 0.05
"""Relative error beyond which a range is that of another laser's spot."""


@dataclass(frozen=True)
class Scene:
    """True range of each laser, mm; lost beams are missing."""

    key: str
    ranges_mm: Mapping[str, float]


@dataclass
class ColourBench:
    """Lasers of a rig, seen by a grey camera behind a band-pass filter and by a camera of three sensors."""

    rig: Rig
    spec: EmulatorSpec
    truth: Truth
    scene: BenchScene
    response: FloatArray
    """True (3, 3) response."""
    random: np.random.Generator

    @classmethod
    def of(cls, rig: Rig, seed: int, folder: Path) -> ColourBench:
        """Bench with the truth of a seed; targets stand exactly."""
        spec = emulator_spec(rig)
        truth = draw_truth(rig, spec)
        random = np.random.default_rng(seed)
        response = np.abs(RESPONSE + RESPONSE_SD * random.standard_normal((3, 3)))
        np.fill_diagonal(response, 1.0)
        return cls(rig, spec, truth, BenchScene(rig, spec, truth, folder / "t.yaml"), response, random)

    def spots(self, scene: Scene) -> dict[str, list[SpotImage]]:
        """Images of the spots of each laser, each on a flat at its own range."""
        found = {}
        for laser, range_mm in scene.ranges_mm.items():
            self.scene.place(Placement(key=f"{scene.key}/{laser}", standoff_mm=range_mm))
            found[laser] = self.scene.spots(laser)
        return found

    def grey(self, spots: Sequence[SpotImage]) -> tuple[Image, Image]:
        """Lit and dark frame of the grey camera behind its band-pass filter."""
        ((lit, dark),) = self._pairs([spots], 1.0)
        return lit, dark

    def colours(self, spots: Mapping[str, list[SpotImage]]) -> list[tuple[Image, Image]]:
        """Lit and dark frames of the three sensors, with one exposure."""
        seen = [
            [
                SpotImage(one.left, one.top, one.rate * np.float32(self.response[channel, COLOUR_OF[laser]]))
                for laser, images in spots.items()
                for one in images
            ]
            for channel in range(len(COLOURS))
        ]
        return self._pairs(seen, BAND_RATIO)

    def _pairs(self, channels: Sequence[Sequence[SpotImage]], ambient: float) -> list[tuple[Image, Image]]:
        camera, limits = self.rig.camera, self.spec.camera
        level = ambient * self.spec.ambient.level_e_per_s
        light = self.spec.ambient.model_copy(update={"level_e_per_s": level})
        spec = self.spec.model_copy(update={"ambient": light})
        sensor = ImageSensor(spec, ImageFormat(camera.width_px, camera.height_px), camera.bits)
        metered = min(sensor.metered_exposure(spots, 1.0, limits.metered_peak) for spots in channels)
        exposure = min(max(metered, limits.shortest_exposure_s), limits.longest_exposure_s)
        return [
            (
                sensor.expose(spots, exposure, 1.0, 1.0, self.random),
                sensor.expose((), exposure, 1.0, 1.0, self.random),
            )
            for spots in channels
        ]


@dataclass(frozen=True)
class ResponseEstimate:
    """Response of the sensors to the colours, (3, 3), with its standard deviations."""

    mean: FloatArray
    sd: FloatArray

    @classmethod
    def measured(cls, bench: ColourBench, ranger: Ranger) -> ResponseEstimate:
        """Posterior of the prior and of captures of each laser alone."""
        weight = np.full((3, 3), RESPONSE_SD**-2)
        total = RESPONSE * weight
        for laser, colour in COLOUR_OF.items():
            for number in range(FIRED):
                images = bench.spots(Scene(f"alone/{number}", {laser: 400.0}))
                pairs = bench.colours(images)
                spots = find_spots(*pairs[colour], scanlines=ranger.searched((laser,)), expected=1).spots
                if len(spots) == 1:
                    value, sd = amplitudes(spots[0], pairs)
                    share = value / value[colour]
                    share_var = (sd / value[colour]) ** 2 + (share * sd[colour] / value[colour]) ** 2
                    weight[:, colour] += 1 / share_var
                    total[:, colour] += share / share_var
        mean, sd = total / weight, weight**-0.5
        # Relative to the best sensor, whose own response is 1 by definition.
        np.fill_diagonal(mean, 1.0)
        np.fill_diagonal(sd, 0.0)
        return cls(mean, sd)

    def colour(self, value: FloatArray, sd: FloatArray) -> int | None:
        """Colour of a spot by its amplitudes in the channels; None where two colours explain them alike."""
        chi2 = []
        for mean, mean_sd in zip(self.mean.T, self.sd.T, strict=True):
            variance = sd**2 + (mean_sd * value.max()) ** 2
            height = max(float((mean * value / variance).sum() / (mean**2 / variance).sum()), 0.0)
            chi2.append(float(((value - height * mean) ** 2 / variance).sum()))
        best, second = np.argsort(chi2)[:2]
        return int(best) if chi2[second] - chi2[best] > LEAST_MARGIN else None


def amplitudes(spot: Spot, pairs: Sequence[tuple[Image, Image]]) -> tuple[FloatArray, FloatArray]:
    """Amplitude of a spot's profile in each channel, relative to its exposure, and its standard deviation."""
    u, v = round(spot.u_px), round(spot.v_px)
    height, width = pairs[0][0].shape
    rows = slice(max(0, v - HALF_WINDOW), min(height, v + HALF_WINDOW + 1))
    columns = slice(max(0, u - HALF_WINDOW), min(width, u + HALF_WINDOW + 1))
    y, x = np.mgrid[rows, columns]
    profile = np.exp(-((x - spot.u_px) ** 2 + (y - spot.v_px) ** 2) / (2 * spot.width_px**2)).ravel()
    design = np.column_stack([profile, np.ones_like(profile)])
    covariance = np.linalg.inv(design.T @ design)
    value, sd = [], []
    for on, off in pairs:
        difference = (on[rows, columns].astype(float) - off[rows, columns]).ravel()
        fitted = covariance @ design.T @ difference
        scatter = difference - design @ fitted
        value.append(fitted[0])
        sd.append(np.sqrt(covariance[0, 0] * scatter @ scatter / (len(profile) - 2)))
    return np.array(value), np.array(sd)


@dataclass
class GreyCaptures:
    """Captures of a scene by the grey camera; each has the exposure of its brightest spot."""

    bench: ColourBench
    ranger: Ranger
    images: Mapping[str, list[SpotImage]]
    count: int = 0

    def capture(self, ids: tuple[str, ...]) -> Finding:
        """Spots of a pair with these lasers on."""
        self.count += 1
        lit = [one for laser in ids for one in self.images.get(laser, [])]
        return find_spots(
            *self.bench.grey(lit),
            scanlines=self.ranger.searched(ids),
            expected=len(ids),
            speckle_sd_px=self.ranger.speckle_sd_px,
        )


def read_grey(bench: ColourBench, ranger: Ranger, scene: Scene) -> tuple[Reading, int]:
    """Reading as by `workbench range`, and the number of pairs: alone are the ambiguous lasers only."""
    captures = GreyCaptures(bench, ranger, bench.spots(scene))
    return acquire(ranger, scene.key, captures.capture), captures.count


def read_thesis(bench: ColourBench, ranger: Ranger, scene: Scene) -> tuple[Reading, int]:
    """Reading as by the thesis's control, and the number of pairs: all alone unless each has a spot."""
    captures = GreyCaptures(bench, ranger, bench.spots(scene))
    ids = ranger.sensor.ids
    spots = captures.capture(ids).spots
    if len(spots) == len(ids) or not spots:
        return ranger.read_lit(scene.key, spots), captures.count
    alone = [(laser, captures.capture((laser,)).spots) for laser in ids]
    return read_alone(ranger, scene, alone), captures.count


def read_alone(ranger: Ranger, scene: Scene, found: Sequence[tuple[str, Sequence[Spot]]]) -> Reading:
    """Reading of spots whose lasers are known, where each has a single one on its line."""
    known = [
        (laser, spots[0])
        for (laser, _), spots in zip(found, spots_on_line(ranger.sensor, found), strict=True)
        if len(spots) == 1
    ]
    ids = [laser for laser, _ in known]
    position, sd, speckle_sd = spot_arrays([spot for _, spot in known])
    return ranger.read_known(scene.key, len(ids), ids, position, sd, speckle_sd_px=speckle_sd)


def read_colours(bench: ColourBench, ranger: Ranger, response: ResponseEstimate, scene: Scene) -> Reading:
    """Reading of one pair of colour frames: in each channel the spots of its colour, on the laser's line."""
    pairs = bench.colours(bench.spots(scene))
    found: list[tuple[str, Sequence[Spot]]] = []
    for channel, (on, off) in enumerate(pairs):
        lasers = tuple(laser for laser, colour in COLOUR_OF.items() if colour == channel)
        spots = find_spots(
            on, off, scanlines=ranger.searched(lasers), speckle_sd_px=ranger.speckle_sd_px
        ).spots
        own = [spot for spot in spots if response.colour(*amplitudes(spot, pairs)) == channel]
        found += [(laser, own) for laser in lasers]
    return read_alone(ranger, scene, found)


def drawn_scene(key: str, random: np.random.Generator) -> Scene:
    """Object before a wall: the beams up to a random one meet the object, the others the wall."""
    near, far = (float(np.exp(random.uniform(*np.log(ends)))) for ends in (NEAR_MM, WALL_MM))
    edge = random.integers(0, len(COLOUR_OF) + 1)
    ranges = {laser: near if n < edge else far for n, laser in enumerate(COLOUR_OF)}
    return Scene(key, {laser: mm for laser, mm in ranges.items() if random.random() >= LOST})


@dataclass
class Score:
    """Sums over readings of one way."""

    readings: int = 0
    pairs: int = 0
    visible: int = 0
    missing: int = 0
    beside: int = 0
    """Those of them on the wall, where another beam meets the object."""
    wrong: int = 0
    ranges: int = 0
    invented: int = 0
    """Ranges of lasers whose beam was lost."""

    def add(self, scene: Scene, reading: Reading, pairs: int, ruler: float) -> None:
        """Count a reading; `ruler`: true standoff over reading of the ruler."""
        found = {one.laser_id: one.range_mm for one in reading.lasers}
        self.readings += 1
        self.pairs += pairs
        self.visible += len(scene.ranges_mm)
        self.ranges += len(found)
        lost = [mm for laser, mm in scene.ranges_mm.items() if laser not in found]
        self.missing += len(lost)
        self.beside += sum(mm > min(scene.ranges_mm.values()) for mm in lost)
        self.invented += sum(laser not in scene.ranges_mm for laser in found)
        self.wrong += sum(
            abs(mm / (ruler * scene.ranges_mm[laser]) - 1) > WRONG
            for laser, mm in found.items()
            if laser in scene.ranges_mm
        )

    def line(self, name: str) -> str:
        """A line of the table."""
        pairs = self.pairs / self.readings
        rate = FRAMES_PER_S / (FRAMES_OF_PAIR * pairs)
        shares = (self.missing / self.visible, self.wrong / max(self.ranges, 1))
        shown = " | ".join(f"{share:.4f}" for share in shares)
        counts = f"{self.missing} | {self.beside} | {self.invented}"
        return f"{name} | {self.readings} | {pairs:.2f} | {rate:.1f} | {shown} | {counts}"


def run(readings: int, seed: int, folder: Path) -> tuple[dict[str, Score], ResponseEstimate, FloatArray]:
    """Scores of both ways on the same scenes; the response as measured, and the true one."""
    rig = load_rig(ROOT / "rigs/thesis-emulated.yaml")
    exact = {"placement_sd_mm": 0.0, "tilt_sd_deg": 0.0, "target_tilt_sd_deg": 0.0}
    still = rig.model_copy(update={"bench": rig.bench.model_copy(update=exact)})
    ranger = Ranger(calibration_of(rig))
    bench = ColourBench.of(still, seed, folder)
    response = ResponseEstimate.measured(bench, ranger)
    random = np.random.default_rng([seed, 1])
    scores = {name: Score() for name in (THESIS, OURS, COLOURED)}
    for number in range(readings):
        scene = drawn_scene(f"scene/{number}", random)
        ruler = 1 + bench.truth.ruler_scale
        scores[THESIS].add(scene, *read_thesis(bench, ranger, scene), ruler)
        scores[OURS].add(scene, *read_grey(bench, ranger, scene), ruler)
        scores[COLOURED].add(scene, read_colours(bench, ranger, response, scene), 1, ruler)
    return scores, response, bench.response


def main() -> int:
    """Compare both ways, print and store the table."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--readings", type=int, default=READINGS)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        scores, response, true = run(given.readings, given.seed, Path(folder))
    worst = np.abs(response.mean - true).max()
    lines = [
        "way | readings | pairs a reading | readings a second at 30 frames | missing | wrong | missing (n) |"
        " of them on the wall beside an object (n) | ranges of lost beams (n)",
        *(score.line(name) for name, score in scores.items()),
        "",
        f"response: prior sd {RESPONSE_SD:g}, measured to {response.sd.max():.4f}, largest error {worst:.4f}",
    ]
    command = f"python -m tests.proofs.colours --readings {given.readings} --seed {given.seed}"
    store("colours", "Lasers of three colours", command, ["", *lines, ""])
    return 0


if __name__ == "__main__":
    sys.exit(main())
