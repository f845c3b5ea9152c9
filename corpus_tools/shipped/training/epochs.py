"""Training of scikit-learn's multilayer perceptrons at a learning rate that falls, which Adam lacks there."""

import warnings
from typing import Any

import numpy as np
from numpy.typing import NDArray


def fit_epochs(
    model: Any, inputs: NDArray[np.float32], targets: NDArray[Any], rates: tuple[float, float], n_epochs: int
) -> None:
    """Fit a model in epochs, from the first learning rate to the last in equal ratios; repeated calls are equal."""
    # The state of the random numbers goes on from epoch to epoch.
    model.set_params(max_iter=1, warm_start=True, random_state=np.random.RandomState(0))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that it has not converged after one epoch
        for rate in np.geomspace(*rates, n_epochs):
            model.set_params(learning_rate_init=rate).fit(inputs, targets)
