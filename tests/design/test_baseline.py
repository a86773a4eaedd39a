import json

import pytest

from hsv.design.baseline import design_gains


@pytest.mark.long
def test_the_report_is_json_and_carries_the_inputs(inputs):
    report = json.loads(json.dumps(design_gains(inputs).report, allow_nan=False))
    assert report["vertices"] == 20
    assert report["inputs"] == inputs.model_dump(exclude_none=True)


@pytest.fixture
def simple(inputs):
    """The inputs with the model that takes no time to find."""
    return inputs.model_copy(update={"model": inputs.model.model_copy(update={"representation": "grid"})})


def test_progress_is_told_and_ends_complete(simple):
    single = simple.model_copy(update={"nominal": simple.nominal.model_copy(update={"scales": [1.0]})})
    told = []
    result = design_gains(single, lambda *event: told.append(event))
    assert [stage for stage, done, total in told if done == total] == [
        "polytopic model",
        "feedback gain",
        "nominal gains",
    ]
    assert result.design.nominal_gains.shape == (1, 2, 9)
