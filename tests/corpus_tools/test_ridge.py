"""Ridge regression against its own definition."""

import numpy as np
import pytest

from corpus_tools.training.ridge import fit_ridge


def test_leave_one_out_errors_equal_those_of_refitting_without_each_row() -> None:
    generator = np.random.default_rng(0)
    terms, wanted = generator.normal(size=(15, 3)), generator.normal(size=(15, 2))
    wanted -= wanted.mean(axis=0)
    effort, total = 2.0, 0.0
    penalty = np.diag([0.0, effort, effort, effort])  # the constant is free
    for row in range(15):
        rest = np.arange(15) != row
        design = np.column_stack([np.ones(14), terms[rest] - terms.mean(axis=0)])
        weights = np.linalg.solve(design.T @ design + penalty, design.T @ wanted[rest])
        here = np.concatenate([[1.0], terms[row] - terms.mean(axis=0)])
        total += float(np.square(wanted[row] - here @ weights).sum())
    assert fit_ridge(terms, wanted, [effort]).left_out_error == pytest.approx(total, rel=1e-9)


def test_noise_selects_strong_regularisation_and_an_exact_law_none() -> None:
    generator = np.random.default_rng(1)
    terms = generator.normal(size=(40, 10))
    law = terms @ generator.normal(size=(10, 1))
    noise = generator.normal(size=(40, 1))
    law, noise = law - law.mean(axis=0), noise - noise.mean(axis=0)
    sizes = [np.abs(fit_ridge(terms, wanted).weights).sum() for wanted in (law, noise)]
    least = [
        np.abs(np.linalg.lstsq(terms - terms.mean(axis=0), wanted, rcond=None)[0]).sum() for wanted in (law, noise)
    ]
    assert sizes[0] > 0.95 * least[0]
    assert sizes[1] < 0.7 * least[1]
