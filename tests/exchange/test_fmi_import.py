"""FMUs as parts: an oscillator that the test compiles, and the Reference FMUs where they are."""

import math
import pickle
import shutil
import subprocess
import zipfile
from pathlib import Path

import numpy as np
import pytest

import atwood
from atwood import FMU, AtwoodError, Scene, load_scene, save_scene, simulate
from atwood.exchange.fmi.binary import describe, platform_folder
from atwood_library.scenes import DoublePendulum

REFERENCE = Path(__file__).parents[3] / "shared" / "reference" / "fmu"

DESCRIPTION = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="Oscillator" guid="osc" numberOfEventIndicators="0">
<ModelExchange modelIdentifier="osc"/>
<UnitDefinitions><Unit name="m"><BaseUnit m="1"/></Unit></UnitDefinitions>
<ModelVariables>
<ScalarVariable name="body.x[1]" valueReference="0" causality="output" initial="exact"><Real start="1" unit="m"/>
</ScalarVariable>
<ScalarVariable name="v" valueReference="1" initial="exact"><Real start="0"/></ScalarVariable>
<ScalarVariable name="der(x)" valueReference="2"><Real derivative="1"/></ScalarVariable>
<ScalarVariable name="der(v)" valueReference="3"><Real derivative="2"/></ScalarVariable>
<ScalarVariable name="k" valueReference="4" causality="parameter" variability="tunable"><Real start="4"/>
</ScalarVariable>
<ScalarVariable name="u" valueReference="5" causality="input" variability="continuous"><Real start="0"/>
</ScalarVariable>
<ScalarVariable name="energy" valueReference="6" causality="output"><Real/></ScalarVariable>
<ScalarVariable name="note" valueReference="7" causality="parameter"><String start="hm"/></ScalarVariable>
</ModelVariables>
<ModelStructure><Derivatives><Unknown index="3"/><Unknown index="4"/></Derivatives></ModelStructure>
</fmiModelDescription>"""

SOURCE = """
#include <math.h>
#include <stdlib.h>
#include <string.h>
typedef struct { double v[7]; } M;
void *fmi2Instantiate(const char *n, int k, const char *g, const char *r, const void *f, int a, int b)
{ M *m; (void)n; (void)k; (void)r; (void)f; (void)a; (void)b; if (strcmp(g, "osc")) return NULL;
  m = calloc(1, sizeof(M)); m->v[0] = 1; m->v[4] = 4; return m; }
void fmi2FreeInstance(void *m) { free(m); }
int fmi2SetupExperiment(void *m, int a, double b, double c, int d, double e)
{ (void)m; (void)a; (void)b; (void)c; (void)d; (void)e; return 0; }
int fmi2EnterInitializationMode(void *m) { (void)m; return 0; }
int fmi2ExitInitializationMode(void *m) { (void)m; return 0; }
int fmi2EnterEventMode(void *m) { (void)m; return 0; }
int fmi2EnterContinuousTimeMode(void *m) { (void)m; return 0; }
int fmi2NewDiscreteStates(void *m, int *e) { (void)m; memset(e, 0, 5 * sizeof(int)); return 0; }
int fmi2SetTime(void *m, double t) { (void)m; (void)t; return 0; }
int fmi2CompletedIntegratorStep(void *m, int a, int *b, int *c) { (void)m; (void)a; *b = *c = 0; return 0; }
static int rates(M *m)
{ m->v[2] = m->v[1]; m->v[3] = m->v[5] - m->v[4] * m->v[0];
  m->v[6] = 0.5 * (m->v[1] * m->v[1] + m->v[4] * m->v[0] * m->v[0]); return m->v[4] < 0 ? 3 : 0; }
int fmi2SetContinuousStates(void *p, const double *x, size_t n) { memcpy(((M *)p)->v, x, n * 8); return 0; }
int fmi2GetContinuousStates(void *p, double *x, size_t n) { memcpy(x, ((M *)p)->v, n * 8); return 0; }
int fmi2GetDerivatives(void *p, double *x, size_t n)
{ M *m = p; int s = rates(m); memcpy(x, m->v + 2, n * 8); if (m->v[4] > 1e6) x[0] = NAN; return s; }
int fmi2GetReal(void *p, const unsigned *r, size_t n, double *x)
{ size_t i; rates(p); for (i = 0; i < n; i++) x[i] = ((M *)p)->v[r[i]]; return 0; }
int fmi2SetReal(void *p, const unsigned *r, size_t n, const double *x)
{ size_t i; for (i = 0; i < n; i++) ((M *)p)->v[r[i]] = x[i]; return 0; }
"""


@pytest.fixture(scope="module")
def oscillator(tmp_path_factory):
    """Return the path of an FMU that is compiled."""
    compiler = shutil.which("cc")
    if compiler is None:
        pytest.skip("no C compiler: cc")
    folder = tmp_path_factory.mktemp("fmu")
    (folder / "osc.c").write_text(SOURCE)
    subprocess.run([compiler, "-shared", "-fPIC", "-o", "osc.so", "osc.c", "-lm"], cwd=folder, check=True)
    return packed(folder / "osc.fmu", {f"binaries/{platform_folder(2)}/osc.so": (folder / "osc.so").read_bytes()})


def packed(path, files, description=DESCRIPTION):
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", description)
        for name, data in files.items():
            archive.writestr(name, data)
    return path


def with_part(*args, **values):
    scene = Scene()
    scene.add("f", FMU(*args, **values))
    return scene


@pytest.mark.parametrize("form", ["reduced", "dae"])
def test_states_inputs_and_parameters_are_those_of_the_part(oscillator, form):
    scene = with_part(oscillator, k=9.0, u="2.0 + 0*t")
    scene.start["f.body_x_1"] = 0.5
    result = simulate(scene, form=form, t_end=2.0, rtol=1e-10)
    exact = 2 / 9 + (0.5 - 2 / 9) * np.cos(3 * result.time)
    np.testing.assert_allclose(result["f.body_x_1"], exact, atol=1e-8)
    np.testing.assert_allclose(
        result["f.energy"], 0.5 * (result["f.v"] ** 2 + 9 * result["f.body_x_1"] ** 2), rtol=1e-12
    )
    assert scene.f.fields["body.x[1]"] == "body_x_1"
    assert "String" in scene.f.left_out["note"]


def test_a_run_again_has_the_same_bits_and_a_sweep_the_values_of_its_parameters(oscillator):
    scene = with_part(oscillator)
    first, second = simulate(scene, t_end=1.0), simulate(scene, t_end=1.0)
    assert np.array_equal(first["f.v"], second["f.v"])
    swept = atwood.sweep(scene, {"f.k": [1.0, 4.0]}, t_end=1.0, rtol=1e-9)
    np.testing.assert_allclose(np.asarray(swept["f.body_x_1"])[:, -1], [math.cos(1.0), math.cos(2.0)], atol=1e-7)


def test_scenes_with_an_fmu_are_written_and_read_with_trust_alone(oscillator, tmp_path):
    scene = with_part(oscillator, k=9.0)
    save_scene(scene, tmp_path / "s.json")
    with pytest.raises(AtwoodError, match="foreign code"):
        load_scene(tmp_path / "s.json")
    read = load_scene(tmp_path / "s.json", trust=[str(oscillator)])
    again = pickle.loads(pickle.dumps(scene))
    expected = simulate(scene, t_end=1.0)["f.v"]
    for one in (read, again):
        assert np.array_equal(simulate(one, t_end=1.0)["f.v"], expected)


def test_what_the_fmu_refuses_is_an_error(oscillator):
    with pytest.raises(AtwoodError, match="returns error"):
        simulate(with_part(oscillator, k=-1.0), t_end=1.0)
    with pytest.raises(AtwoodError):
        simulate(with_part(oscillator, k=1e7), t_end=1.0)
    with pytest.raises(AtwoodError, match="'k'"):
        FMU(oscillator, kk=1.0)


def test_many_runs_leave_no_instances(oscillator):
    scene = with_part(oscillator)
    history = scene.f._history
    for _ in range(5):
        simulate(scene, t_end=0.1)
    assert len(history._instances) <= 8
    known = len(history._moments)
    simulate(scene, t_end=0.1)
    assert len(history._moments) == known


@pytest.mark.parametrize(
    ("files", "description", "words"),
    [
        ({"../out.txt": b""}, DESCRIPTION, "outside"),
        ({"/out.txt": b""}, DESCRIPTION, "outside"),
        ({}, '<!DOCTYPE a [<!ENTITY b "c">]>' + DESCRIPTION.partition("?>")[2], "document type"),
        ({}, DESCRIPTION[:-40], "no XML"),
        ({}, DESCRIPTION.replace('fmiVersion="2.0"', 'fmiVersion="1.0"'), "FMI 1.0"),
        ({}, DESCRIPTION.replace('guid="osc"', ""), "cannot be read"),
        ({}, DESCRIPTION.replace('start="4"', 'start="nan"'), "finite"),
        ({"binaries/other/osc.so": b""}, DESCRIPTION, "other"),
        ({f"binaries/{platform_folder(2)}/osc.so": b"no"}, DESCRIPTION, "cannot be loaded|none for"),
    ],
)
def test_bad_archives_are_refused(tmp_path, files, description, words):
    path = packed(tmp_path / "bad.fmu", files, description)
    with pytest.raises(AtwoodError, match=words):
        FMU(path)


def test_damaged_files_are_refused(tmp_path):
    good = packed(tmp_path / "good.fmu", {}).read_bytes()
    for data in (b"", b"hello", good[: len(good) // 2]):
        (tmp_path / "bad.fmu").write_bytes(data)
        with pytest.raises(AtwoodError):
            FMU(tmp_path / "bad.fmu")
    with pytest.raises(AtwoodError):
        FMU(tmp_path / "none.fmu")


@pytest.mark.parametrize("fmi", [2, 3])
def test_an_exported_scene_is_the_same_when_it_comes_back(tmp_path, fmi):
    if shutil.which("cc") is None:
        pytest.skip("no C compiler: cc")
    scene = DoublePendulum()
    atwood.export_fmu(scene, tmp_path / "dp.fmu", fmi=fmi)
    expected = simulate(scene, t_end=2.0, rtol=1e-11, atol=1e-12)
    back = simulate(with_part(tmp_path / "dp.fmu"), t_end=2.0, rtol=1e-11, atol=1e-12)
    for path in ("rod1.angle", "bob2.position.x", "rod1.tension"):
        assert back["f." + path.replace(".", "_")][-1] == pytest.approx(expected[path][-1], abs=1e-9)


# -- the Reference FMUs ------------------------------------------------------------------------------------------


def reference(version, name):
    path = REFERENCE / str(version) / f"{name}.fmu"
    if not path.exists():
        pytest.skip(f"{path.name} of the Reference FMUs is not there")
    if not any(one.startswith(f"binaries/{platform_folder(version)}/") for one in zipfile.ZipFile(path).namelist()):
        pytest.skip(f"{path.name} has no binary for {platform_folder(version)}")
    return path


def height(t):
    """Return the height of the Reference FMUs' ball."""
    g, h, v = 9.81, 1.0, 0.0
    while (flight := (v + math.sqrt(v * v + 2 * g * h)) / g) < t:
        t, v, h = t - flight, -0.7 * (v - g * flight), 0.0
        if v < 0.1:
            return 0.0
    return h + v * t - g * t * t / 2


@pytest.mark.parametrize("version", [2, 3])
def test_bounces_are_located(version):
    scene = with_part(reference(version, "BouncingBall"))
    result = simulate(scene, t_end=3.0, rtol=1e-10)
    np.testing.assert_allclose(result["f.h"], [height(t) for t in result.time], atol=1e-9)
    again = simulate(scene, t_end=3.0, rtol=1e-10)
    assert np.array_equal(again["f.h"], result["f.h"])


@pytest.mark.parametrize("version", [2, 3])
def test_dahlquist_and_stair_have_their_solutions_in_both_kinds(version):
    path = reference(version, "Dahlquist")
    exact = simulate(with_part(path, k=2.0), t_end=2.0, rtol=1e-10)
    np.testing.assert_allclose(exact["f.x"], np.exp(-2.0 * exact.time), atol=1e-9)
    stepped = simulate(with_part(path, kind="co-simulation"), t_end=2.0)
    assert stepped["f.x"][-1] == pytest.approx(0.9**20, rel=1e-12)
    for kind in ("model exchange", "co-simulation"):
        stairs = simulate(with_part(reference(version, "Stair"), kind=kind), t_end=8.5)
        assert set(stairs["f.counter"]) == set(range(1, 10))


def test_arrays_are_numbers_and_roberts_kinetics_keeps_its_mass():
    scene = with_part(reference(3, "StateSpace"), A_1_1=-1.0)
    result = simulate(scene, t_end=1.0, rtol=1e-10)
    assert result["f.x_1"][-1] == pytest.approx(1.0 - math.exp(-1.0), abs=1e-9)
    assert result["f.x_2"][-1] == pytest.approx(2.0 * (math.e - 1.0), abs=1e-8)
    stiff = simulate(with_part(reference(3, "Roberts")), t_end=40.0, rtol=1e-8, solver="ida")
    assert stiff["f.y1"][-1] == pytest.approx(0.7158270687, abs=1e-6)  # Hairer and Wanner, section IV.10


@pytest.mark.parametrize("version", [2, 3])
def test_feedthrough_and_resource(version):
    for kind in ("model exchange", "co-simulation"):
        scene = with_part(reference(version, "Feedthrough"), kind=kind, Float64_continuous_input="sin(t)")
        result = simulate(scene, t_end=1.0)
        assert result["f.Float64_continuous_output"][-1] == pytest.approx(math.sin(1.0), abs=1e-12)
        assert simulate(with_part(reference(version, "Resource"), kind=kind), t_end=0.1)["f.y"][-1] == 97.0


def test_clocks_are_refused():
    with pytest.raises(AtwoodError, match="scheduled execution"):
        describe(reference(3, "Clocks"))
