r"""Correlation functions of records, block by block.

.. math:: R_l = \frac{1}{N} \sum_t y(t + l)\, y_{ref}(t)^T

Of a linear structure under white loads they are free decays for l > 0: :math:`R_l = \sum_r \phi_r g_r^T \mu_r^l` and
conjugates.
Source: James, Carne, Lauffer, Modal Analysis 10 (1995) 260. The blocks of one record are nearly independent, so their scatter
is the covariance of the mean (Reynders, Pintelon, De Roeck, MSSP 22 (2008) 948).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import fft

from toolpoint._check import FloatArray, fail
from toolpoint._notebook import NotebookText

MIN_CORRELATED_BLOCK_LAGS = 2.0  # block over its longest lag, so that blocks hardly share any samples


@dataclass(frozen=True, eq=False)
class Correlations(NotebookText):
    """Correlation functions of all channels with the reference channels.

    Parameters
    ----------
    blocks : (n_blocks, n_lags, n_channels, n_references) floats
        Of every block, lags 0, 1, ...
    interval : float
        Between lags, s.
    references : tuple of int
        Channel of each reference.
    """

    blocks: FloatArray
    interval: float
    references: tuple[int, ...]

    @property
    def mean(self) -> FloatArray:
        """Mean over the blocks, shape (n_lags, n_channels, n_references)."""
        return self.blocks.mean(axis=0)

    @property
    def deviations(self) -> FloatArray:
        """Deviation of every block from the mean, shape (n_blocks, n_lags n_channels n_references)."""
        return (self.blocks - self.blocks.mean(axis=0)).reshape(self.blocks.shape[0], -1)

    def __repr__(self) -> str:
        blocks, lags, channels, references = self.blocks.shape
        return (f"Correlations({channels} channels with {references} references, {lags} lags of {self.interval:.4g} s, "
                f"{blocks} blocks)")


def correlate_blocks(samples: list[FloatArray], interval: float, references: list[int], *, lags: int,
                     blocks: int) -> Correlations:
    """Return the correlations of records with the same channels, in about `blocks` blocks of one length over all records.

    Parameters
    ----------
    samples : list of (n_samples, n_channels) floats
        Without their mean. No block reaches over the gap between two records.
    interval : float
        Between samples, s.
    references : list of int
        Columns of the reference channels.
    lags : int
        Longest lag, samples.
    blocks : int

    Raises
    ------
    ToolpointError
        Where a block would be shorter than twice the longest lag.
    """
    total = sum(part.shape[0] for part in samples)
    length = (total - lags * len(samples)) // blocks
    if length < MIN_CORRELATED_BLOCK_LAGS * lags:
        fail("records", f"{total * interval:.4g} s",
             f"must be at least {blocks * (MIN_CORRELATED_BLOCK_LAGS + 1) * lags * interval:.4g} "
             f"s: {blocks} blocks of correlations {lags * interval:.3g} s long",
             remedy="record longer, or raise the lowest frequency")
    products = [_correlate(part[start:start + length + lags], references, lags)
                for part in samples for start in range(0, part.shape[0] - length - lags + 1, length)]
    return Correlations(np.array(products), interval, tuple(references))


def _correlate(segment: FloatArray, references: list[int], lags: int) -> FloatArray:
    """Return R of one segment, shape (lags + 1, n_channels, n_references), by transforms padded against wrap-around.

    The references end `lags` samples before the segment, so every lag has the same number of products.
    """
    length = segment.shape[0] - lags
    size = fft.next_fast_len(segment.shape[0], real=True)
    outputs = fft.rfft(segment, size, axis=0)
    inputs = fft.rfft(segment[:length, references], size, axis=0)
    result = np.empty((lags + 1, segment.shape[1], len(references)))
    for k in range(len(references)):
        result[:, :, k] = fft.irfft(inputs[:, k, None].conj() * outputs, size, axis=0)[:lags + 1] / length
    return result
