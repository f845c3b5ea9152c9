"""The table of measures in the panel that compares."""

from tts2face.serving.studio.pages.compare_panel import measures_html


def test_the_table_lists_lips_and_channels_that_both_move() -> None:
    found = {
        "lips": [{"name": "opening", "r": 0.932, "ratio": 1.0}, {"name": "width", "r": None, "ratio": 0.5}],
        "channels": [{"name": "<b>", "r": -0.2, "ratio": 2.0}, {"name": "pitch", "r": 0.1, "ratio": 0.3},
                     {"name": "brows0", "r": None, "ratio": None}],
        "dtw_cost": 0.456, "is_same_time": True,
    }  # fmt: skip
    html = measures_html(found)
    assert '<th scope="row">lip opening</th><td>0.93</td><td>1.00</td>' in html
    assert '<th scope="row">lip width</th><td>-</td><td>0.50</td>' in html
    assert '<th scope="row">&lt;b&gt;</th><td>-0.20</td>' in html
    assert '<th scope="row">head pitch</th>' in html
    assert "brows0" not in html
    assert "Channels that move in one of both only: 1." in html
    assert "differ by 0.46 standard deviations" in html
    assert "other times" in measures_html({**found, "is_same_time": False, "dtw_cost": None})
