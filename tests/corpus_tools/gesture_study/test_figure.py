"""Panels: histograms by hand, logarithmic axes, the same panels in the page and in the picture."""

import re
from dataclasses import replace
from io import BytesIO
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
from PIL import Image

from corpus_tools.studies.gestures.gaze import compare, made_person
from corpus_tools.studies.gestures.page import (
    COLUMNS,
    HEAD,
    HEIGHT,
    N_BINS,
    WIDTH,
    autocorrelation_panel,
    distribution_panel,
    gaze_panels,
    gestures_page,
    panel_svg,
    panels_plot,
    spectrum_panel,
    summary_panels,
)
from corpus_tools.studies.plots import PNG_SCALE, SERIES, load_matplotlib
from tts2face.models.gaze import STATES, load_gaze


@pytest.fixture
def calm(found):
    return found.styles[0]


def drawn(panel):
    load_matplotlib()
    from matplotlib.figure import Figure

    axes = Figure().subplots()
    panel.draw(axes)
    return axes


def steps(axes):
    return {patch.get_label(): patch.get_data() for patch in axes.patches}


@pytest.mark.needs("matplotlib")
def test_a_distribution_is_in_percent_and_holds_what_is_beyond(calm):
    compared = calm.trait_comparisons[0]
    found = steps(drawn(distribution_panel(calm, compared)))
    kinds = {
        "recorded": compared.real, "field": compared.field, "noise": compared.noise, "ju2008": compared.published,
    }  # fmt: skip
    assert set(found) == set(kinds)
    for name, values in kinds.items():
        shares, edges, _ = found[name]
        inside = [((values >= low) & (values < high)).mean() for low, high in pairwise(edges[:-1])]
        inside[0] += (values < edges[0]).mean()
        np.testing.assert_allclose(shares[:-1], 100 * np.array(inside), rtol=1e-12)
        assert shares.sum() == pytest.approx(100)
        assert len(shares) == N_BINS


@pytest.mark.needs("matplotlib")
def test_a_derived_style_has_no_line_of_the_published_field(found):
    quick = found.styles[1]
    assert set(steps(drawn(distribution_panel(quick, quick.trait_comparisons[0])))) == {"calm", "field", "noise"}
    assert [line.get_label() for line in drawn(spectrum_panel(quick, quick.motion_comparisons[0])).lines] == [
        "calm",
        "field",
        "noise",
    ]


@pytest.mark.needs("matplotlib")
def test_a_trait_without_values_is_an_empty_plot(calm):
    none = np.zeros(0)
    empty = SimpleNamespace(real=none, field=none, noise=none, published=none, trait=calm.trait_comparisons[0].trait)
    axes = drawn(distribution_panel(calm, empty))
    assert not axes.patches
    assert axes.get_xlim() == (0, 1)


@pytest.mark.needs("matplotlib")
def test_a_spectrum_names_powers_of_ten_and_its_unit(calm):
    (moving,) = (one for one in calm.motion_comparisons if one.feature == "head")
    axes = drawn(spectrum_panel(calm, moving))
    assert [line.get_label() for line in axes.lines] == ["recorded", "field", "noise", "ju2008"]
    for line, one in zip(axes.lines, moving.spectra, strict=True):
        np.testing.assert_array_equal(line.get_ydata(), one.power[1:])
    assert axes.get_ylabel() == "power, deg²/Hz"
    words = re.findall(r">([^<>]+)</text>", panel_svg(spectrum_panel(calm, moving)))
    assert {"0.1", "1"} <= set(words)
    assert not [word for word in words if "$" in word or "^" in word]


@pytest.mark.needs("matplotlib")
def test_the_gaze_of_people_and_of_made_people_has_a_line_for_each(found):
    people = [{state: made_person(load_gaze(), state, seed) for state in STATES} for seed in range(2)]
    study = compare(people, load_gaze(), n_made=3, seed=5)
    panels = gaze_panels(study)
    assert [panel.title for panel in panels[::3]] == ["speaking: looks at the face", "listening: looks at the face"]
    axes = drawn(panels[0])
    assert [line.get_label() for line in axes.lines if not line.get_label().startswith("_")] == ["people", "made"]
    assert len(axes.lines) == 4
    np.testing.assert_array_equal(axes.lines[0].get_ydata(), 100 * study.people["speaking"][0].face.shares)
    html = gestures_page(replace(found, styles=(), gaze=study))
    assert html.count("<svg") == 6
    assert html.count("<td>met</td>") + html.count("<td>missed</td>") == 8
    assert "<h2>Gaze in conversation</h2>" not in gestures_page(replace(found, styles=()))


@pytest.mark.needs("matplotlib")
def test_repetition_is_over_seconds_of_lag(calm):
    axes = drawn(autocorrelation_panel(calm, "head"))
    line = axes.lines[1]
    assert line.get_xdata()[0] == 5.5
    np.testing.assert_array_equal(line.get_ydata(), calm.long_run.repetition["head"].speech[5:])


@pytest.mark.needs("matplotlib")
def test_the_picture_shows_each_panel_in_its_place(calm):
    panels = summary_panels(calm)
    with Image.open(BytesIO(panels_plot("title", panels).png())) as image:
        rows = -(-len(panels) // COLUMNS)
        assert image.size == (COLUMNS * WIDTH * PNG_SCALE, (rows * HEIGHT + HEAD) * PNG_SCALE)
        pixels = np.asarray(image.convert("RGB"))
    for at in range(len(panels)):
        column, row = at % COLUMNS * WIDTH * PNG_SCALE, (HEAD + at // COLUMNS * HEIGHT) * PNG_SCALE
        part = pixels[row : row + HEIGHT * PNG_SCALE, column : column + WIDTH * PNG_SCALE].reshape(-1, 3)
        for colour, _ in SERIES[:4]:
            assert (part == tuple(bytes.fromhex(colour[1:]))).all(axis=1).any()
