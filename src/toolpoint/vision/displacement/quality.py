"""Quality: whether a clip can carry amplitudes and damping, or frequencies and shapes only, and why.

A sensor's noise is white in time. Compression with loss smooths it away before it smooths motion, and what is left of small
motion is too small and decays too fast, while the picture looks cleaner than before: so it is the noise that is asked.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from toolpoint._doubt import Doubt
from toolpoint.vision.displacement.measure import Scan
from toolpoint.vision.displacement.survey import MAX_SATURATED_FRACTION

# Correlation of successive changes (-0.5 is white), of neighbours (0), kurtosis (3). x264 on noise of two grey levels:
# quality 10: -0.494 0.01 3.15, quality 14: -0.495 0.02 3.3, quality 18: -0.458 0.15 4.4, 23: less noise than one level.
MAX_WHITENESS, MAX_GRAIN_CORRELATION, MAX_NOISE_KURTOSIS = -0.46, 0.06, 3.8
MIN_RESOLVED_NOISE = 0.35  # grey levels: noise below is hidden by the rounding to whole levels
MAX_REPEATED_FRAMES = 0  # frames equal to the one before
# Excess kurtosis below which the noise cannot show compression.
MIN_COMPRESSION_LOSS = 0.03


@dataclass(frozen=True, eq=False)
class Quality:
    """Verdict on a clip.

    accepts_amplitude : whether amplitudes, damping and their intervals can be trusted; doubts : reasons, worst first; notes :
    remarks that change nothing; loss : what compression took of the noise (excess kurtosis of its changes), 0 for a clip
    without loss: in 16 clips by x264 at qualities 1 to 14, damping came out up to 2.8 times this share too large.
    """

    accepts_amplitude: bool
    doubts: tuple[Doubt, ...] = ()
    notes: tuple[Doubt, ...] = field(default=())
    loss: float = 0.0


def judge_quality(scanned: Scan) -> Quality:
    """Return whether a clip can carry amplitudes and damping.

    >>> import numpy as np
    >>> from scipy import ndimage
    >>> from toolpoint.vision import clip_of, scan
    >>> rng, time = np.random.default_rng(0), np.arange(60) / 200  # s
    >>> texture = 128 + 60 * ndimage.zoom(rng.standard_normal((12, 16)), 4)
    >>> decay = 0.5 * np.exp(-3 * time) * np.cos(2 * np.pi * 20 * time)  # pixels to the right
    >>> frames = [ndimage.shift(texture, (0, x), mode="nearest") + rng.normal(0, 1, texture.shape) for x in decay]
    >>> scanned = scan(clip_of(np.clip(frames, 0, 255).astype(np.uint8), 200.0))
    >>> judge_quality(scanned).accepts_amplitude
    True
    """
    clip, survey, reference = scanned.clip, scanned.survey, scanned.reference
    refusals: list[Doubt] = []
    notes: list[Doubt] = []
    is_smoothed = (reference.whiteness > MAX_WHITENESS or reference.grain > MAX_GRAIN_CORRELATION
                   or reference.kurtosis > MAX_NOISE_KURTOSIS)
    if clip.is_lossy and (is_smoothed or reference.noise < MIN_RESOLVED_NOISE):
        refusals.append(Doubt(
            "compressed too much", f"the noise of the sensor is smoothed away ({reference.noise:.2f} grey levels left, "
            f"correlation of successive changes {reference.whiteness:.3f}, of neighbours {reference.grain:.2f}, kurtosis "
            f"{reference.kurtosis:.1f}; a sensor has -0.5, 0 and 3), so small motion is too; amplitudes and damping are not "
            "given", "record with less compression (x264 at quality 10 or better), or raw frames"))
    elif is_smoothed and reference.noise > MIN_RESOLVED_NOISE:
        notes.append(Doubt("noise", f"is not that of a sensor (correlation of successive changes {reference.whiteness:.3f} "
                           f"instead of -0.5, of neighbours {reference.grain:.2f} instead of 0): the camera or a conversion "
                           "smoothed the frames; stated uncertainties may be too small"))
    if len(survey.repeats) > MAX_REPEATED_FRAMES:
        refusals.append(Doubt(
            "frames", f"{len(survey.repeats)} frames repeat the one before, first frame {survey.repeats[0]}: the true rate is "
            "lower than stated or frames were filled in; damping is not given", "export the frames of the camera as they are"))
    refusals += list(survey.doubts)
    if reference.noise < MIN_RESOLVED_NOISE:
        notes.append(Doubt("noise", f"{reference.noise:.2f} grey levels are below the rounding of the levels: stated "
                           "uncertainties are rough", "a little more gain makes small motion measurable"))
    clipped_fraction = float((survey.saturated > 0.5).mean())
    if clipped_fraction > MAX_SATURATED_FRACTION:
        notes.append(Doubt("picture", f"{100 * clipped_fraction:.0f} % of it is black or white (saturated) and shows no motion",
                           figure=clipped_fraction))
    loss = max(reference.kurtosis - 3, MIN_COMPRESSION_LOSS) if clip.is_lossy else 0.0
    return Quality(not refusals, tuple(refusals), tuple(dict.fromkeys((*clip.doubts, *notes))), loss)


