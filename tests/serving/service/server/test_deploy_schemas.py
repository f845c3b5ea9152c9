"""The files of Compose and Kubernetes against the schemas of their tools, without a network."""

import copy
import json
from typing import Any

import pytest
import yaml

from tests.docs.blocks import DOCS
from tests.interchange.exports.programs import node_package
from tests.packages import package

FOLDER = DOCS / "deploy"
COMPOSE: dict[str, Any] = yaml.safe_load((FOLDER / "compose.yaml").read_text())
OBJECTS: list[dict[str, Any]] = list(yaml.safe_load_all((FOLDER / "kubernetes.yaml").read_text()))


def test_compose_follows_its_specification() -> None:
    """By the schema that comes with the npm package dclint."""
    jsonschema = package("jsonschema")
    schema = json.loads((node_package("dclint") / "dclint/schemas/compose.schema.json").read_text())
    check = jsonschema.Draft7Validator(schema)
    assert [error.message for error in check.iter_errors(COMPOSE)] == []
    wrong = copy.deepcopy(COMPOSE)
    wrong["services"]["server"]["readonly"] = True
    assert ["readonly" in error.message for error in check.iter_errors(wrong)] == [True]


@pytest.mark.parametrize("number", range(len(OBJECTS)))
def test_kubernetes_knows_every_field(number: int) -> None:
    """By the schemas of the package kubernetes-validate, which allow no other fields."""
    validator = pytest.importorskip("kubernetes_validate", reason="needs the package kubernetes-validate")
    version, content = validator.latest_version(), OBJECTS[number]
    validator.validate(content, version, strict=True)
    wrong = copy.deepcopy(content)
    wrong["metadata"]["nam"] = "tts2face"
    with pytest.raises(validator.ValidationError, match="nam"):
        validator.validate(wrong, version, strict=True)
