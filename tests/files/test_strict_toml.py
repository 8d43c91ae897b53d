"""Every mistake in a file is one line: file, field, value, fix."""

import json
import time
from typing import Annotated

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import Field, field_validator

from uas_coverage_env.files.strict_toml import InputError, StrictModel, parse, read_toml


class Wheel(StrictModel):
    radius_m: Annotated[float, Field(gt=0)]
    position_m: tuple[float, float, float]


class Engine(StrictModel):
    power_W: float
    kind: str | None = None


class Car(StrictModel):
    version: int = Field(alias="schema", ge=1, le=1)
    name: str
    seats: int = 4
    fast: bool = False
    engine: Engine
    wheels: tuple[Wheel, ...] = Field(min_length=1)
    spare: Wheel | None = None

    @field_validator("name")
    @classmethod
    def is_not_a_horse(cls, name: str) -> str:
        if name == "horse":
            raise ValueError("'horse' is no car;\n name a car")
        return name


WHEEL = "[[wheels]]\nradius_m = 0.3\nposition_m = [1, 2.0, 0]\n"
GOOD = f'schema = 1\nname = "beetle"\n[engine]\npower_W = 30000\n{WHEEL}'


def read(tmp_path, text):
    path = tmp_path / "car.toml"
    path.write_text(text, encoding="utf-8")
    return read_toml(path, Car)


def line_of(tmp_path, text):
    """The one line that says what is wrong, without the file's name."""
    with pytest.raises(InputError) as caught:
        read(tmp_path, text)
    line = str(caught.value)
    start = f"{tmp_path / 'car.toml'}: "
    assert line.startswith(start)
    assert len(line.splitlines()) == 1
    assert caught.value.__cause__ is None
    assert caught.value.__suppress_context__ or caught.value.__context__ is None
    return line.removeprefix(start)


def test_a_correct_file_is_read_and_whole_numbers_become_floats(tmp_path):
    car = read(tmp_path, GOOD)
    assert car.engine.power_W == 30000.0
    assert isinstance(car.engine.power_W, float)
    assert car.wheels[0].position_m == (1.0, 2.0, 0.0)
    assert car.seats == 4


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("radius_m = 0.3", "radius_m = -3", "wheels[0].radius_m: should be greater than 0, not -3"),
        ("radius_m = 0.3", 'radius_m = "3"', 'wheels[0].radius_m: should be a number, not "3"'),
        ("radius_m = 0.3", "radius_m = true", "wheels[0].radius_m: should be a number, not true"),
        (
            "radius_m = 0.3",
            "radius_m = nan",
            "wheels[0].radius_m: should be a finite number, not nan",
        ),
        (
            "[1, 2.0, 0]",
            "[1, -inf, 0]",
            "wheels[0].position_m[1]: should be a finite number, not -inf",
        ),
        ("[1, 2.0, 0]", "[1, 2.0]", "wheels[0].position_m[2]: is missing; add it"),
        (
            "[1, 2.0, 0]",
            "[1, 2, 3, 4]",
            "wheels[0].position_m: takes at most 3 of them, not 4; take some away",
        ),
        ("[1, 2.0, 0]", "7", "wheels[0].position_m: should be a list, not 7"),
        ("power_W = 30000", "", "engine.power_W: is missing; add it"),
        (
            "power_W = 30000",
            "powr_W = 30000",
            "engine.powr_W: unknown key; did you mean power_W? (+1 more)",
        ),
        (
            "power_W = 30000",
            "power_W = 30000\ncolour = 1",
            "engine.colour: unknown key; allowed here: power_W, kind",
        ),
        (
            "radius_m = 0.3",
            "radius_m = 0.3\nradus_m = 1",
            "wheels[0].radus_m: unknown key; did you mean radius_m?",
        ),
        ('name = "beetle"', "name = 3", "name: should be text in quotes, not 3"),
        (
            'name = "beetle"',
            "name = 2026-01-01",
            "name: should not be a date or time (2026-01-01); quote text",
        ),
        ('name = "beetle"', 'name = "horse"', "name: 'horse' is no car; name a car"),
        (
            'name = "beetle"',
            'name = "beetle"\nseats = 4.0',
            "seats: should be a whole number, not 4.0",
        ),
        (
            'name = "beetle"',
            'name = "beetle"\nseats = true',
            "seats: should be a whole number, not true",
        ),
        ('name = "beetle"', 'name = "beetle"\nfast = 1', "fast: should be true or false, not 1"),
        ("schema = 1", "schema = 2", "schema: should be less than or equal to 1, not 2"),
        ("schema = 1", "schema = true", "schema: should be a whole number, not true"),
        ("schema = 1", "", "schema: is missing; add it"),
        (
            "schema = 1",
            "version = 1",
            "version: unknown key; allowed here: schema, name, seats, fast, engine, wheels, spare"
            " (+1 more)",
        ),
        (WHEEL, "[wheels]", "wheels: should be a list, not {}"),
        (WHEEL, "", "wheels: is missing; add it"),
        (
            "schema = 1",
            "schema = 1\nwheels = []",
            "is not valid TOML: Cannot overwrite a value (at end of document); correct the syntax "
            "there",
        ),
        ("[engine]\npower_W = 30000", "engine = 3", "engine: should be a table, not 3"),
    ],
)
def test_a_mistake_is_named_with_its_field_and_value(tmp_path, old, new, expected):
    assert old in GOOD
    found = line_of(tmp_path, GOOD.replace(old, new))
    if "valid TOML" in expected:
        # the parser's own words differ between versions of Python
        assert found.startswith("is not valid TOML: ")
        assert found.endswith("; correct the syntax there")
    else:
        assert found == expected


def test_an_empty_list_asks_for_what_is_missing():
    data = {"schema": 1, "name": "sledge", "engine": {"power_W": 0.0}, "wheels": []}
    expected = "memory: wheels: needs at least 1 of them, not 0; add what is missing"
    with pytest.raises(InputError) as caught:
        parse(data, Car, "memory")
    assert str(caught.value) == expected


def test_several_mistakes_are_counted_and_unknown_keys_come_first(tmp_path):
    text = GOOD.replace("radius_m = 0.3", 'radius_m = "a"\nextra = 1').replace('"beetle"', "1")
    assert line_of(tmp_path, text).startswith("wheels[0].extra: unknown key; ")
    assert line_of(tmp_path, text).endswith(" (+2 more)")


def test_a_rejected_entry_is_not_also_reported_as_too_few_entries(tmp_path):
    text = GOOD.replace("radius_m = 0.3", 'radius_m = "a"')
    assert line_of(tmp_path, text) == 'wheels[0].radius_m: should be a number, not "a"'


def test_a_long_value_is_shortened(tmp_path):
    line = line_of(tmp_path, GOOD.replace("30000", '"' + "x" * 5000 + '"'))
    assert len(line) < 140


@pytest.mark.parametrize("text", ["a = = 1", "[", 'name = "a\nb"', "a = 1\na = 2", "\x00"])
def test_a_syntax_error_is_one_line(tmp_path, text):
    assert line_of(tmp_path, text).startswith("is not valid TOML: ")


def test_a_file_that_cannot_be_read_is_named(tmp_path):
    with pytest.raises(InputError, match=r"missing\.toml: no such file"):
        read_toml(tmp_path / "missing.toml", Car)
    with pytest.raises(InputError, match="is a folder"):
        read_toml(tmp_path, Car)
    with pytest.raises(InputError, match="cannot be read"):
        read_toml(tmp_path / ("x" * 5000), Car)
    binary = tmp_path / "binary.toml"
    binary.write_bytes(b"name = \xff\xfe")
    with pytest.raises(InputError, match=r"byte 7 is not UTF-8; save the file as UTF-8"):
        read_toml(binary, Car)


@pytest.mark.parametrize("depth", [200, 5000])
def test_deep_nesting_is_a_mistake_and_no_crash(tmp_path, depth):
    assert line_of(tmp_path, "name = " + "[" * depth + "]" * depth)
    assert line_of(tmp_path, ".".join(["a"] * depth) + " = 1")


def test_data_in_memory_may_use_tuples_and_null():
    wheel = {"radius_m": 1, "position_m": (0, 0, 0)}
    engine = {"power_W": 1, "kind": None}
    car = parse({"schema": 1, "name": "a", "engine": engine, "wheels": (wheel,)}, Car, "memory")
    assert car.engine.kind is None
    with pytest.raises(InputError, match=r"memory: name: should be plain data, not bytes"):
        parse({"schema": 1, "name": b"a", "engine": engine, "wheels": (wheel,)}, Car, "memory")


def test_what_is_read_cannot_be_changed_and_a_changed_copy_is_checked(tmp_path):
    car = read(tmp_path, GOOD)
    with pytest.raises(ValueError, match="frozen"):
        car.name = "mini"
    assert car.model_copy(update={"seats": 2}).seats == 2
    assert car.model_copy() == car
    with pytest.raises(ValueError, match="valid integer"):
        car.model_copy(update={"seats": "two"})
    with pytest.raises(ValueError, match="unknown field 'seat'; Car has version, name, seats"):
        car.model_copy(update={"seat": 2})


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: (
        st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=8), inner, max_size=4)
    ),
    max_leaves=12,
)


@settings(max_examples=200, deadline=None, derandomize=True)
@given(
    st.fixed_dictionaries(
        {},
        optional={key: JSON for key in ("schema", "name", "engine", "wheels", "spare", "other")},
    )
)
def test_whatever_is_given_the_answer_is_a_car_or_one_line(data):
    try:
        car = parse(data, Car, "memory")
    except InputError as error:
        line = str(error)
    else:
        line = f"memory: {car.name!r} has schema {car.version}"
        assert json.loads(car.model_dump_json(by_alias=True))["schema"] == 1
    assert line.startswith("memory: ")
    assert len(line.splitlines()) == 1


@pytest.mark.parametrize(
    "text",
    [
        "a" + ".a" * 100_000 + " = 1\n",
        "name = 'car'\n[" + '"a" . ' * 50_000 + "a]\n",
        "engine = {" + "a." * 100_000 + "b = 1}\n",
    ],
    ids=["key", "table", "inline"],
)
def test_a_row_of_keys_without_end_is_refused_at_once(tmp_path, text):
    path = tmp_path / "car.toml"
    path.write_text(text)
    started = time.process_time()
    with pytest.raises(InputError, match=r"line \d: names keys more than 32 deep; flatten"):
        read_toml(path, Car)
    assert time.process_time() - started < 1.0


def test_numbers_and_texts_with_many_points_are_no_keys(tmp_path):
    path = tmp_path / "car.toml"
    numbers = "[0.5, " + "1.25," * 200 + "]"
    path.write_text(f"schema = 1\nname = '{'.' * 500}'\nnumbers = {numbers}\n")
    with pytest.raises(InputError, match="numbers: unknown key"):
        read_toml(path, Car)


def test_a_file_beyond_16_MiB_is_refused(tmp_path):
    path = tmp_path / "car.toml"
    path.write_bytes(b"#" * (2**24 + 1))
    with pytest.raises(InputError, match=r"car\.toml: is larger than 16\.8 MB"):
        read_toml(path, Car)
