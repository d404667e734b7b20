"""Tests of configs written for pydantic 1 and for pydantic 2; the tests run with several releases of pydantic."""

import copy
import importlib
import json
import pickle
import subprocess
import sys
import warnings

import pytest
from pydantic import Extra, Field, ValidationError

from pogema_rs import GridConfig, pogema_v0
from pogema_rs._models import IS_PYDANTIC_1
from pogema_rs.toolbox.algorithm_config import AlgoBase

# Classes as training code for POGEMA 1.4.0 defines them.
SOURCE = """
from typing import Any, Dict, List, Optional, Union

from pydantic import Extra

from pogema_rs import GridConfig
from pogema_rs.toolbox.algorithm_config import AlgoBase

SHARED = {"a": 1}


class Training(GridConfig):
    worker_index: int = None
    vector_index: Optional[int]
    either: Union[int, str, None]
    tag = "run"
    weights = [0.5, 1]
    num_agents = 3
    size: int = 12
    density = 0.25
    on_target: str = "restart"
    _hidden = 5

    class Config:
        extra = Extra.forbid

    @property
    def area(self):
        return self.width * self.height

    def double(self):
        return 2 * self.num_agents


class More(Training):
    tag = "more"
    depth: int = 2


class Open(GridConfig):
    class Config:
        extra = Extra.allow


class Inference(AlgoBase, extra=Extra.forbid):
    name: str = "Mine"
    num_process = 2
    path_to_weights = "model/weights"
    model_name: str = None
    preprocessing: Optional[Dict[str, Any]]
    seeds: List[int] = [1, 2]
"""
FUTURE = "from __future__ import annotations\n"


@pytest.fixture(scope="module", params=["", FUTURE], ids=["types", "texts"])
def written(request, tmp_path_factory):
    """The module with the classes, whose annotations are types or strings."""
    folder = tmp_path_factory.mktemp("written")
    name = "written_as_texts" if request.param else "written_as_types"
    (folder / f"{name}.py").write_text(request.param + SOURCE)
    sys.path.insert(0, str(folder))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield importlib.import_module(name)
    sys.path.remove(str(folder))


def test_class_attributes_without_annotation_become_fields(written):
    config = written.Training()
    fields = config.dict()
    expected = {"worker_index": None, "vector_index": None, "either": None, "tag": "run", "weights": [0.5, 1]}
    assert {name: fields[name] for name in expected} == expected
    assert written.Training(tag="other", weights=[], either="x").tag == "other"
    assert config.area == 144 and config.double() == 6
    assert written.More().dict()["tag"] == "more" and written.More().depth == 2
    for wrong in ({"tag": []}, {"weights": 3}, {"num_agents": "many"}, {"worker_index": "x"}, {"on_target": "x"}):
        with pytest.raises(ValidationError) as raised:
            written.Training(**wrong)
        assert next(iter(wrong)) in str(raised.value)


def test_defaults_of_a_subclass_reach_the_engine(written):
    config = written.Training(seed=1)
    assert (config.num_agents, config.width, config.height, config.density) == (3, 12, 12, 0.25)
    observations, _ = pogema_v0(config).reset()
    assert len(observations) == 3
    expected = GridConfig(num_agents=3, size=12, density=0.25, on_target="restart", seed=1).dict()
    assert {name: config.dict()[name] for name in expected} == expected
    assert written.Training(num_agents=5, size=9).dict()["width"] == 9


def test_none_is_accepted_where_it_is_the_default(written):
    config = written.Training(worker_index=None, vector_index=None)
    assert config.worker_index is None
    assert written.Training(**config.dict()) == config
    assert written.Training(worker_index=3).worker_index == 3
    assert written.Inference(**written.Inference().dict()) == written.Inference()


def test_unknown_fields_follow_the_config_of_the_class(written):
    for wrong in (written.Training, written.More, written.Inference):
        with pytest.raises(ValidationError, match="worker_indx"):
            wrong(worker_indx=1)
    assert written.Open(extra_field=3).extra_field == 3
    for make in (GridConfig, GridConfig().update_config, lambda **fields: pogema_v0(fields)):
        with pytest.warns(UserWarning, match="did you mean `seed`") as caught:
            make(sed=1)
        assert [warning.filename for warning in caught] == [__file__]


def test_copies_are_equal_and_methods_of_both_releases_agree(written):
    config = written.Training(worker_index=2, seed=4)
    for twin in (copy.deepcopy(config), pickle.loads(pickle.dumps(config)), config.copy(), config.model_copy()):
        assert twin == config and type(twin) is written.Training
    assert config.dict() == config.model_dump() and json.loads(config.json()) == json.loads(config.model_dump_json())
    assert set(config.model_fields if IS_PYDANTIC_1 else type(config).model_fields) >= {"tag", "seed"}
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        config.update_config(size=7, tag="new")
    assert (config.width, config.worker_index, config.tag) == (7, 2, "new")


def test_settings_of_algorithms_have_defaults_and_take_values(written):
    settings = written.Inference(num_process=1)
    assert (settings.num_process, settings.path_to_weights, settings.preprocessing) == (1, "model/weights", None)
    assert isinstance(settings, AlgoBase) and settings.parallel_backend == "balanced_multiprocessing"


SUPPORTED = """
import warnings
warnings.simplefilter("ignore")
from pydantic import Field, root_validator, validator
from pogema_rs import GridConfig


class Checked(GridConfig):
    worker_index: int = 0

    @validator("worker_index")
    def check_index(cls, value):
        assert value < 9, "too large"
        return value


assert Checked(worker_index=3).worker_index == 3
try:
    Checked(worker_index=9)
except ValueError as error:
    assert "too large" in str(error)
else:
    raise SystemExit("worker_index 9 was accepted")


class Unsupported(GridConfig):
"""
UNSUPPORTED = {
    '    kind: str = Field("a", const=True)': "`const` is removed, use `Literal` instead",
    '    kind: str = Field("a", regex="a+")': "`regex` is removed. use `pattern` instead",
    "    check = root_validator(lambda cls, values: values)": "you MUST specify `skip_on_failure=True`",
}


@pytest.mark.skipif(IS_PYDANTIC_1, reason="pydantic 1 supports it")
@pytest.mark.parametrize("line", UNSUPPORTED)
def test_features_that_pydantic_2_lacks_raise_an_error_that_shows_the_line(line, tmp_path):
    script = tmp_path / "left.py"
    script.write_text(f"{SUPPORTED}{line}\n")
    done = subprocess.run([sys.executable, "-B", str(script)], capture_output=True, text=True, check=False)
    assert f"line {SUPPORTED.count(chr(10)) + 1}, in Unsupported" in done.stderr, done.stderr
    assert UNSUPPORTED[line] in done.stderr


def test_fields_are_set_by_their_alias():
    class Named(GridConfig):
        num_agents: int = Field(3, alias="agents")
        tag: str = Field("none", alias="label")

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        config = Named(agents=5, label="run", size=6)
    assert (config.num_agents, config.tag, config.size) == (5, "run", 6)
    assert (Named(size=6).num_agents, Named(size=6).tag) == (3, "none")
    assert len(pogema_v0(config).reset()[0]) == 5
    config.update_config(num_agents=2)
    assert (config.num_agents, config.tag) == (2, "run")


def test_extra_fields_count_as_set():
    class Open(GridConfig):
        class Config:
            extra = Extra.allow

    config = Open(seed=1, note="kept")
    assert sorted(config.dict(exclude_unset=True)) == ["note", "seed"]
    assert sorted(GridConfig(seed=1).dict(exclude_unset=True)) == ["seed"]
