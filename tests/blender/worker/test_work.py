# SPDX-License-Identifier: GPL-3.0-or-later
"""Work in a real child: the same results, cancelled in every stage, killed, refused, in turn."""

import os
import resource
import signal
import sys
import threading
import time

import bpy
import numpy as np
import pytest
import scenes
from workers import children, wait_for

NAME = "bl_ext.user_default.salient_simplify"


MOST = 12_000
"""Points of a scan on which every stage takes long enough to be seen."""


def task_of(work, *requests):
    return work.Task([lambda request=request: request for request in requests], work.host)


def flat(value):
    """Return all arrays and values of an answer, one after another."""
    if isinstance(value, dict):
        return [item for key in value for item in (key, *flat(value[key]))]
    if isinstance(value, list | tuple):
        return [item for part in value for item in flat(part)]
    return [value]


def assert_same(one, other):
    one, other = flat(one), flat(other)
    assert len(one) == len(other)
    for first, second in zip(one, other, strict=True):
        np.testing.assert_array_equal(first, second)


WORDS = (
    {"task": "simplify"},
    {"task": "simplify", "placement": "optimal"},
    {"task": "rank"},
    {"task": "saliency"},
    {"task": "regions"},
)


@pytest.mark.parametrize("kind", ["mesh", "points", "cloud"])
def test_the_child_answers_as_this_process_does(work, request_of, module, kind):
    obj = scenes.torus()
    if kind != "mesh":
        {"points": scenes.points_mesh, "cloud": scenes.cloud}[kind](scenes.positions(obj))
    for words in WORDS:
        request = request_of(**words)
        (answer,) = task_of(work, request).finish()
        assert_same(answer, module("worker.requests").run(request))


def test_several_requests_in_a_row_and_their_errors(work, request_of, module):
    obj = scenes.torus()
    requests = [request_of(number=k, ratio=0.1 * (k + 1)) for k in range(3)]
    task = task_of(work, *requests)
    shares = []
    while not task.advance():
        shares.append(task.fraction)
        work.host.wait(0.1)
    assert shares == sorted(shares)
    assert task.fraction == 1.0
    (errors,) = task_of(work, {"task": "measure", "numbers": [0, 1, 2]}).finish()
    salcore = module("salcore")
    points, faces = scenes.positions(obj).astype(float), module("geometry.read").triangles(obj.data)
    for request, error in zip(requests, errors, strict=True):
        words = salcore.Parameters(error_unit="length")
        arrays = module("geometry.read").mesh_arrays(obj.data)
        seams = module("geometry.topology").kept_lines(arrays, seams=True, sharp=True)
        uv = arrays.layers(split=False)
        analysis = salcore.analyze(points, faces[0], parameters=words)
        report = analysis.simplify(seams=seams, corner_values=uv, **request["targets"][0]).report
        assert error["max"] == report.errors.surface.max
        assert error["points"] == 800


def stages_of(work, *requests):
    """Run requests to their end and return the stages that were seen."""
    task, seen = task_of(work, *requests), []
    while not task.advance():
        if task.stage not in seen:
            seen.append(task.stage)
        work.host.wait(0.01)
    return seen, task.results


def test_cancelled_in_every_stage(work, request_of, extension):
    """Nothing changes, the child is ready again at once, and the next result is the same."""
    scenes.scan(MOST)
    before, known, caught = scenes.fingerprint(extension), set(), set()
    for number, target in enumerate(({"ratio": 0.1}, {"alpha": 5.0}, {"max_error": 0.001})):
        # Analysed anew for each target: the kept analysis would skip its stages.
        request = request_of() | {"targets": [target], "number": 0}
        request["points"] = request["points"] + 100.0 * number
        stages, expected = stages_of(work, request, {"task": "measure", "numbers": [0]})
        assert len(stages) >= 4, stages
        pid = work.host.pid
        for stage in stages:
            if stage in known:  # the same work, whatever is asked for
                continue
            known.add(stage)
            moved = request | {"points": request["points"] + 1.0 + stages.index(stage)}
            task = task_of(work, moved, {"task": "measure", "numbers": [0]})
            while task.stage != stage and not task.advance():
                work.host.wait(0.01)
            if not task.done:  # a short stage can slip by
                caught.add(stage)
            task.cancel()
            assert work.host.state in ("stopping", "idle")
            wait_for(work.host, "idle", seconds=2.0)
            assert work.host.pid == pid
            assert scenes.fingerprint(extension) == before
        assert_same(stages_of(work, request, {"task": "measure", "numbers": [0]})[1], expected)
    assert {"Graph", "Elimination"} < caught
    assert len(caught) >= 0.7 * len(known)


def test_a_second_ratio_comes_from_the_kept_analysis(work, request_of):
    scenes.scan(MOST)
    first, _ = stages_of(work, request_of(ratio=0.1))
    second, (answer,) = stages_of(work, request_of(ratio=0.3))
    assert {"Graph", "Elimination"} <= set(first)
    assert not {"Graph", "Elimination"} & set(second)
    assert len(answer["levels"][0]["indices"]) == round(0.3 * MOST)


def test_a_new_request_waits_until_the_cancelled_one_has_stopped(work, request_of):
    scenes.scan(MOST)
    request = request_of()
    first = task_of(work, request)
    while first.stage == "Start":
        first.advance()
    first.cancel()
    (answer,) = task_of(work, request).finish()
    assert len(answer["levels"][0]["indices"]) == round(0.2 * MOST)


def kill_when_busy(work, number=signal.SIGKILL):
    """Kill the child as soon as it works."""

    def kill():
        while work.host.state != "busy":
            time.sleep(0.005)
        time.sleep(0.05)
        os.kill(work.host.pid, number)

    thread = threading.Thread(target=kill)
    thread.start()
    return thread


@pytest.mark.parametrize("output", ["NEW", "IN_PLACE"])
def test_a_killed_child_is_one_sentence_and_an_unchanged_scene(work, extension, output):
    scenes.scan(MOST)
    before = scenes.fingerprint(extension)
    thread = kill_when_busy(work)
    sentence = r"worker process was killed or ran out of memory \(exit status -9\); close other"
    with pytest.raises(RuntimeError, match=sentence) as caught:
        bpy.ops.object.salient_simplify(
            hide_source=False, placement="original", ratio=0.1, output=output
        )
    thread.join()
    assert "Traceback" not in str(caught.value)
    assert scenes.fingerprint(extension) == before
    assert bpy.ops.object.salient_simplify(
        hide_source=False, placement="original", ratio=0.1, output=output
    ) == {"FINISHED"}


def test_a_child_killed_while_idle_is_replaced(work, request_of):
    scenes.torus()
    request = request_of()
    task_of(work, request).finish()
    first = work.host.pid
    os.kill(first, signal.SIGKILL)
    work.host._process.wait()  # until its last thread has ended
    (answer,) = task_of(work, request).finish()
    assert len(answer["levels"][0]["indices"]) == 160
    assert work.host.pid != first


def test_mistakes_are_the_cores_sentences(work, extension):
    obj = scenes.torus()
    obj.vertex_groups.new(name="keep").add(list(range(100)), 1.0, "REPLACE")
    before = scenes.fingerprint(extension)
    with pytest.raises(RuntimeError, match="100 are protected") as caught:
        bpy.ops.object.salient_simplify(
            hide_source=False, placement="original", target="COUNT", count=3, protect="keep"
        )
    assert "Traceback" not in str(caught.value)
    assert scenes.fingerprint(extension) == before
    assert work.host.state == "idle"


def test_more_memory_than_there_is_is_refused(work, extension, request_of):
    scenes.torus()
    request = request_of(level=8)
    request |= {"points": np.random.default_rng(0).random((3_000_000, 3)), "mesh": None}
    error = sys.modules[NAME + ".geometry.read"].HostError
    with pytest.raises(error, match=r"of memory, and .* GB are free"):
        task_of(work, request).finish()
    assert work.host.state == "idle"


@pytest.mark.skipif(not hasattr(resource, "prlimit"), reason="only Linux limits another process")
def test_a_child_out_of_memory_says_so_and_goes_on(work, extension):
    scenes.scan(40_000)
    before = scenes.fingerprint(extension)
    pid = work.host.pid
    with open(f"/proc/{pid}/statm", encoding="ascii") as file:
        size = int(file.read().split()[0]) * os.sysconf("SC_PAGE_SIZE")
    old = resource.prlimit(pid, resource.RLIMIT_AS, (size + 2**24, resource.RLIM_INFINITY))
    with pytest.raises(RuntimeError, match="not enough memory for this object"):
        bpy.ops.object.salient_simplify(
            hide_source=False, placement="original", ratio=0.1, workers=1
        )
    assert scenes.fingerprint(extension) == before
    resource.prlimit(pid, resource.RLIMIT_AS, old)
    assert bpy.ops.object.salient_simplify(
        hide_source=False, placement="original", ratio=0.1, workers=1
    ) == {"FINISHED"}
    assert work.host.pid == pid


def test_an_error_that_nobody_foresaw_shows_where_it_was(work):
    with pytest.raises(RuntimeError, match=r"(?s)worker process failed.*requests\.py"):
        task_of(work, {"task": "simplify", "no such": 1}).finish()
    assert work.host.state == "idle"


def test_two_operators_in_turn(work):
    obj = scenes.torus()
    assert bpy.ops.object.salient_simplify(hide_source=False, placement="original", ratio=0.5) == {
        "FINISHED"
    }
    assert bpy.ops.object.salient_show_saliency() == {"FINISHED"}
    assert bpy.ops.object.salient_live(ratio=0.5) == {"FINISHED"}
    scenes.select(bpy.data.objects["Torus_simplified"], obj)
    assert bpy.ops.object.salient_measure() == {"FINISHED"}
    assert children() == [work.host.pid]


def test_another_file_ends_the_child(work):
    scenes.torus()
    bpy.ops.object.salient_simplify(hide_source=False, placement="original", ratio=0.5)
    assert children() == [work.host.pid]
    bpy.ops.wm.read_factory_settings(use_empty=True)
    assert children() == []
    bpy.ops.preferences.addon_enable(module=NAME)


def test_another_file_ends_the_child_at_work(work, request_of):
    scenes.scan(MOST)
    task = task_of(work, request_of())
    while task.stage == "Start":
        task.advance()
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True, load_ui=False)
    assert children() == []
    assert work.host.state == "off"


def test_disabling_the_add_on_ends_the_child_and_enabling_it_starts_another(module):
    work = module("operators.work")
    work.host.start()
    wait_for(work.host, "idle")
    assert len(children()) == 1
    bpy.ops.preferences.addon_disable(module=NAME)
    assert children() == []
    bpy.ops.preferences.addon_enable(module=NAME)
    work = sys.modules[NAME + ".operators.work"]
    work.host.start()
    wait_for(work.host, "idle")
    scenes.torus()
    assert bpy.ops.object.salient_simplify(hide_source=False, placement="original", ratio=0.5) == {
        "FINISHED"
    }
    work.stop()
    assert children() == []


def test_without_a_child_this_process_works(module, request_of):
    work = module("operators.work")
    scenes.torus()
    host = module("worker.host").Host(["/no/such/python"])
    task = work.Task([request_of], host)
    assert not task.in_process
    (answer,) = task.finish()
    assert task.in_process
    assert len(answer["levels"][0]["indices"]) == 160


def test_few_analyses_are_kept(module, request_of):
    requests = module("worker.requests")
    requests.forget()
    scenes.points_mesh(scenes.relief())
    for k in range(3):
        requests.run(request_of("saliency", cells=4 + k))
    analyses = module("worker.analyses")
    assert analyses.count() == 3
    analyses._drop_old(1300)
    assert analyses.count() == 2
    analyses._drop_old(0)
    assert analyses.count() == 1
    bpy.ops.wm.read_factory_settings(use_empty=True)
    assert analyses.count() == 0


def test_an_analysis_is_reused_until_geometry_or_parameters_change(module, request_of):
    requests = module("worker.requests")
    requests.forget()

    def analysis(**settings):
        requests.run(request_of("saliency", **settings))
        return list(module("worker.analyses")._kept.values())[-1]

    obj = scenes.points_mesh(scenes.relief())
    first = analysis()
    assert analysis() is first
    assert analysis(detail=5.0) is not first
    assert analysis() is first
    obj.name = "renamed"
    obj.data.attributes.new("more", "FLOAT", "POINT")
    assert analysis() is first
    obj.location.x = 1.0
    bpy.context.view_layer.update()
    moved = analysis()
    assert moved is not first
    obj.data.vertices[3].co.z += 0.5
    assert analysis() is not moved
