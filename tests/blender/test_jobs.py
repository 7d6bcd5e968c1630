# SPDX-License-Identifier: GPL-3.0-or-later
"""Long work in slices: the state machine, cancel at every step, and analyses that are reused."""

import time

import bpy
import numpy as np
import pytest
import scenes


def work_of(module, **settings):
    """Return the work of a simplification of the selected objects, as the operator does it."""
    sources, properties = module("sources"), module("properties")
    target = {"ratio": settings.pop("ratio", 0.25)}
    parameters = properties.Parameters(**settings, error_unit="length")

    def steps_of(source):
        return sources.simplification_steps(source, parameters, target, "")

    return sources.each(sources.evaluated(bpy.context), steps_of)


def test_a_job_runs_to_its_end_in_slices(module):
    jobs = module("jobs")
    progress = module("salcore").Progress

    def work():
        for k in range(5):
            time.sleep(0.02)
            yield progress(f"stage {k}", k / 5)
        return "result"

    job = jobs.Job(work())
    seen = []
    while not job.advance(0.03):
        seen.append((job.stage, job.fraction))
    assert job.result == "result"
    assert (job.done, job.cancelled, job.fraction) == (True, False, 1.0)
    assert seen == sorted(seen, key=lambda item: item[1])
    assert 2 <= len(seen) <= 4
    assert job.advance() is True
    job.cancel()
    assert not job.cancelled


def test_a_job_that_fails_is_over(module):
    jobs, error = module("jobs"), module("salcore").SalcoreError

    def work():
        yield module("salcore").Progress("a", 0.5)
        raise error("no")

    job = jobs.Job(work())
    with pytest.raises(error):
        job.finish()
    assert job.cancelled
    assert not job.done


def test_cancel_at_every_step_leaves_the_scene_and_the_next_result_as_they_were(extension, module):
    jobs, analyses = module("jobs"), module("analyses")
    obj = scenes.torus()
    obj.modifiers.new("sub", "SUBSURF").levels = 1
    before = scenes.fingerprint(extension)
    analyses.clear()
    expected = jobs.Job(work_of(module)).finish()[0][1].indices
    for mesh in [mesh for mesh in bpy.data.meshes if not mesh.users]:
        bpy.data.meshes.remove(mesh)
    stop = 1
    while True:
        analyses.clear()
        job = jobs.Job(work_of(module))
        for _ in range(stop):
            if job.advance(0.0):
                break
        if job.done:
            break
        job.cancel()
        assert job.cancelled
        assert scenes.fingerprint(extension) == before, stop
        stop = int(stop * 1.2) + 1
    assert stop > 50
    np.testing.assert_array_equal(job.result[0][1].indices, expected)


def test_an_analysis_is_reused_until_geometry_or_parameters_change(module):
    analyses, jobs, sources = module("analyses"), module("jobs"), module("sources")
    analyses.clear()

    def analysis(**settings):
        parameters = module("properties").Parameters(**settings)
        (source,) = sources.originals(bpy.context)
        return jobs.Job(sources.analysis_steps(source, parameters)).finish()

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


def test_few_analyses_are_kept(module):
    analyses = module("analyses")
    analyses.clear()
    scenes.points_mesh(scenes.relief())
    for k in range(3):
        bpy.ops.object.salient_show_saliency(cells=4 + k)
    assert len(analyses._kept) == 3
    analyses._forget(1300)
    assert len(analyses._kept) == 2
    analyses._forget(0)
    assert len(analyses._kept) == 1
    bpy.ops.wm.read_factory_settings(use_empty=True)
    assert not analyses._kept
