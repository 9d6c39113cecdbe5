"""Every public function of theory has a command, which nothing but its file makes."""

from __future__ import annotations

import inspect
import json
from pathlib import Path

import click
import pytest
from click.testing import CliRunner

import atwood
from atwood.cli import app, main

X, Z = "body.position.x", "body.position.z"


def ran(*arguments: str) -> str:
    done = CliRunner().invoke(main, arguments, catch_exceptions=False)
    assert done.exit_code == 0, done.output
    return done.stdout


def public_functions() -> dict[str, object]:
    """Return the public functions of theory that are asked of a scene, by name."""
    every = {name: getattr(atwood, name) for name in atwood.__all__}
    is_theory = {name: one for name, one in every.items() if getattr(one, "__module__", "").startswith("atwood.theory")}
    return {name: one for name, one in is_theory.items() if inspect.isfunction(one) and asks_a_scene(one)}


def asks_a_scene(function: object) -> bool:
    kinds = getattr(function, "kinds", {})
    return "scene" in kinds or any(kind.of_scene is not None for kind in kinds.values())


def test_every_public_function_of_theory_has_a_command() -> None:
    found = {one.function: name for name, one in app.theory_functions().items()}
    assert set(found) == set(public_functions())
    shown = ran("--help")
    for function, name in found.items():
        made = main.get_command(click.Context(main), name)
        assert made is not None, function
        assert f"\n  {name} " in shown
        assert {"scene", "as_json"} <= {one.name for one in made.params}, name


def test_a_file_with_a_table_of_kinds_is_all_that_a_command_needs(tmp_path: Path, monkeypatch) -> None:
    (tmp_path / "more.py").write_text(
        "from atwood.arguments import BY_PATH, command, takes\n\n\n"
        '@command("short")\n@takes(\n    scene=SCENE,\n    end=BY_PATH,\n)\n'
        "def a_long_name(\n    scene: Model, end: Mapping[str, Any]\n) -> int:\n"
        '    """Return what is new.\n\n    More.\n    """\n\n\n'
        '@takes(scene=SCENE)\ndef other(scene: Model) -> str:\n    """Find `it`."""\n\n\n'
        '@takes(scene=SCENE)\ndef _private(scene: Model) -> str:\n    """Hide."""\n\n\n'
        'def plain(scene: Model) -> str:\n    """Have no table."""\n',
        encoding="utf-8",
    )
    monkeypatch.setattr(app, "_THEORY", tmp_path)
    app.theory_functions.cache_clear()
    try:
        found = app.theory_functions()
    finally:
        app.theory_functions.cache_clear()
    assert {name: (one.function, one.summary) for name, one in found.items()} == {
        "short": ("a_long_name", "Show what is new."),
        "other": ("other", "Find it."),
    }


@pytest.mark.parametrize(
    ("command", "key", "said"),
    [
        ("action simple-pendulum --t-end 1", "value", "S, J s."),
        ("action-angle simple-pendulum", "period", "libration"),
        ("bracket simple-pendulum --f theta --g p_theta", "bracket", "1"),
        ("bracket-algebra kepler", "functions", "2 m L h"),
        ("flow-of simple-pendulum --f p_theta --s s", "leads_to", "θ + s"),
        ("brackets simple-pendulum --function theta --function p_theta", "brackets", "M[1,2] = 1"),
        ("canonical-transformation simple-pendulum --coordinate Q=p_theta --momenta P=-theta", "hamiltonian", "cos P"),
        ("equilibrium-branches simple-pendulum --path gravity --span 9:10", "branches", "26 of 26 points stable"),
        ("generated-transformation simple-pendulum --function theta*P --kind 2 --coordinate Q --momenta P",
         "hamiltonian", "cos Q"),
        ("hamiltonian simple-pendulum", "momenta", "it is conserved"),
        ("motions simple-pendulum --end rod.angle=0.5 --t-end 0.3", "motions", "is_minimum"),
        ("reduced simple-pendulum", "turning_points", "-1, 1"),
        (f"reduced kepler --old '{X}=r*cos(phi)' --old '{Z}=r*sin(phi)'", "elements", "eccentricity"),
        ("root-locus pendulum-on-cart --at rod.angle=0 --path gravity --values 9:11:3", "eigenvalues", "9 to 11"),
        ("routhian kepler", "effective_potential", "√(x² + z²)"),
        ("section double-pendulum --surface 'rod1.angle crosses 0' --quantity rod2.angle --t-end 1", "values", "rad"),
        ("separation kepler", "separates", "does not separate in x, z"),
        (f"separation kepler --coordinate '{X}=r*cos(phi)' --coordinate '{Z}=r*sin(phi)'", "betas", "- t"),
        ("solve-start simple-pendulum --unknown rod.angular_velocity --condition bob.velocity.x=1", "values", "1.850"),
        (
            "solve-initial-values simple-pendulum --unknown rod.angular_velocity --condition bob.velocity.x=1",
            "values",
            "1.850",
        ),
        ("tangent-flow simple-pendulum --t-end 0.1", "matrices", "Liouville"),
        ("total-derivative simple-pendulum --f p_theta**2", "total-derivative", "sin θ"),
        ("transform simple-pendulum --old rod.angle=2*u --coordinate u", "hamiltonian", "p_u² / (m l²)"),
        ("trim simple-pendulum --at rod.angle=0", "values", "rod.angle = 0"),
    ],
)  # fmt: skip
def test_functions_of_theory_are_asked_on_the_command_line(command: str, key: str, said: str) -> None:
    import shlex

    arguments = shlex.split(command)
    assert said in " ".join(ran(*arguments).split())
    data = json.loads(ran(*arguments, "--json"))
    assert key in data


@pytest.mark.parametrize(
    ("arguments", "code", "said"),
    [
        (["actoin", "simple-pendulum"], 2, "Did you mean 'action'"),
        (["root-locus", "simple-pendulum", "--path", "gravity"], 2, "Missing option '--values'"),
        (["root-locus", "simple-pendulum", "--path", "gravity", "--values", "1:2"], 1, "Write FROM:TO:COUNT"),
        (["reduced", "kepler"], 1, "not reduced to one coordinate"),
        (["motions", "simple-pendulum", "--end", "rod.angel=1"], 1, "rod.angle"),
        (["motions", "simple-pendulum", "--end", "rod.angle"], 1, "Write --end PATH=VALUE"),
        (["lyapunov", "simple-pendulum", "--count", "0"], 2, "Give a number of exponents"),
        (["action", "simple-pendulum", "--t-end", "soon"], 2, "Give seconds"),
        (["modes", "double-pendulum", "--at", "rod1.angle=1"], 1, "Give --at values"),
        (
            ["solve-initial-values", "simple-pendulum", "--unknown", "bob.mass", "--condition", "bob.mas=1"],
            1,
            "bob.mas",
        ),
        (["bracket", "simple-pendulum", "--f", "1 +", "--g", "p_theta"], 1, "cannot be read"),
        (["phase", "simple-pendulum", "--coordinates", "3"], 1, "--coordinates: '3' is no range"),
        (["section", "simple-pendulum", "--surface", "rod.angle crosses 0", "--quantity", "rod.angle", "--starts", "3"],
         1, "Write PATH=VALUE,..."),
        (["run", "simple-pendulum", "--accuracy", "1"], 1, "--accuracy cannot be 1.0. Give an error between 1e-15"),
        (["compare", "simple-pendulum", "--max-seconds", "0"], 1, "--max-seconds cannot be 0.0"),
        (["equilibrium-branches", "simple-pendulum", "--path", "gravity", "--span", "10:9"], 1, "--span cannot be"),
    ],
)  # fmt: skip
def test_mistakes_are_answered(arguments: list[str], code: int, said: str) -> None:
    done = CliRunner().invoke(main, arguments, catch_exceptions=False)
    assert done.exit_code == code, done.output
    assert said in done.output
    assert "Traceback" not in done.output


def test_times_have_units_and_pictures_are_drawn(tmp_path: Path) -> None:
    assert json.loads(ran("action", "simple-pendulum", "--t-end", "100 ms", "--json"))["time"] == [0.0, 0.1]
    picture = tmp_path / "locus.png"
    ran(
        "root-locus",
        "pendulum-on-cart",
        "--at",
        "rod.angle=0",
        "--path",
        "gravity",
        "--values",
        "9,10",
        "--plot",
        str(picture),
    )
    assert picture.stat().st_size > 1000


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    "command",
    [
        "action simple-pendulum --t-end 0.5",
        "action-angle simple-pendulum",
        "equations double-pendulum --latex",
        "hamiltonian simple-pendulum",
        "motions simple-pendulum --end rod.angle=0.5 --t-end 0.3",
        "routhian lagrange-top",
        "symmetric-top lagrange-top",
    ],
)
def test_formulas_have_a_picture_of_the_motion_beside_them(command: str, tmp_path: Path) -> None:
    written = ran(*command.split(), "--plot", str(tmp_path / "one.png"))
    assert written
    assert (tmp_path / "one.png").stat().st_size > 5000


@pytest.mark.parametrize(
    ("command", "said"),
    [
        ("bracket-algebra kepler", "what `bracket-algebra` finds here is not drawn"),
        ("hamiltonian kepler", "a phase portrait is of one coordinate"),
        ("modes mass-spring-chain --symbolic", "Leave out --symbolic."),
    ],
)
def test_what_has_no_picture_says_so(command: str, said: str, tmp_path: Path) -> None:
    done = CliRunner().invoke(main, [*command.split(), "--plot", str(tmp_path / "one.png")])
    assert done.exit_code == 1
    assert said in " ".join(done.output.split())
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("more", [(), ("--hamiltonian",)])
def test_parts_of_terms_are_in_the_data(more: tuple[str, ...]) -> None:
    data = json.loads(ran("equations", "double-pendulum", *more, "--by-part", "--json"))
    terms = data["terms"] if more else data["kinetic_energy"]["terms"]
    assert ["bob1", "bob2"] in [one["parts"] for one in terms]
    assert ["bob2"] in [one["parts"] for one in terms]
    assert '"parts"' not in ran("equations", "double-pendulum", *more, "--json")
