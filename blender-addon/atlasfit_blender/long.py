# SPDX-License-Identifier: GPL-3.0-or-later
"""What all operators share: work in a thread with progress and Esc, or at once for scripts; failures as
reports.

An operator gives `prepare(context)`, which reads the scene and returns the work, and `finish(context,
result)`, which writes the result. The work runs without bpy: `work(progress, cancel)`. Nothing is written
before it has ended well, so that a cancelled run changes nothing.

Redo (the panel Adjust Last Operation) runs as a modal operator too: see _again().
"""

import threading
import time

import bpy

from .native import atlasfit

TICK_S = 0.05  # between looks at the thread: well inside the 100 ms that Esc may take
# What goes through to the window while a run is under way: it turns the view and changes nothing.
VIEW = {
    "MIDDLEMOUSE",
    "MOUSEMOVE",
    "INBETWEEN_MOUSEMOVE",
    "WHEELUPMOUSE",
    "WHEELDOWNMOUSE",
    "TRACKPADPAN",
    "TRACKPADZOOM",
    "MOUSEROTATE",
    "MOUSESMARTZOOM",
    "NDOF_MOTION",
    "HOME",
    *(f"NUMPAD_{n}" for n in (*range(10), "PLUS", "MINUS", "PERIOD")),
}
FAILURES = (atlasfit.Error, ValueError, TypeError, ImportError, OSError, MemoryError)


class Refused(ValueError):
    """The scene is not what the operator needs. The text says what to do."""


class Stopped(Exception):
    """Esc was pressed while no call into the library was under way."""


class Status:
    """What the panel shows of the run that is under way; `label` is empty when there is none."""

    label = ""
    stage = ""
    share = 0.0
    left = ""
    redone = False  # the run to come, or the one under way, takes the place of one that was undone


def time_left(seconds, share):
    """ ", 12 s left" after so many seconds, when this share is done; nothing where it would be a guess."""
    if seconds < 1 or share < 0.02 or share >= 1:
        return ""
    left = seconds * (1 - share) / share
    return f", {left:.0f} s left" if left < 90 else f", {left / 60:.0f} min left"


def within(progress, begin, end):
    """`progress` for one of several calls: it goes from one share of all the work to another."""
    return lambda stage, share: progress(stage, begin + (end - begin) * share)


def context_of(window, area, region):
    """The context of a place in a window, for timers, which have none."""
    place = {"window": window, "area": area, "region": region}
    return bpy.context.temp_override(**{name: value for name, value in place.items() if value is not None})


class Job:
    """Work in a thread of its own."""

    def __init__(self, work):
        self.token = atlasfit.Cancel()
        self.asked = False
        self.stage, self.share = "preparing", 0.0
        self.result = self.failure = None
        self.thread = threading.Thread(target=self._run, args=(work,), daemon=True)
        self.thread.start()

    def _run(self, work):
        try:
            self.result = work(progress=self._tell, cancel=self.token)
            if self.asked:
                raise Stopped
        except BaseException as failure:  # told on the main thread, whatever it is
            self.failure = failure

    def _tell(self, stage, share):
        self.stage, self.share = stage, max(self.share, share)  # the bar never falls
        return not self.asked

    def stop(self):
        """Asks the work to end: within 100 ms."""
        self.asked = True
        self.token.request()


class LongOperator:
    """Mixed into an operator: execute, invoke, modal and cancel over its prepare and finish."""

    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        """For scripts and background runs: returns when all is done. For the redo panel and Repeat Last:
        starts a modal run.
        """
        if self.options.is_repeat or self.options.is_repeat_last:
            if context.window is not None and not bpy.app.background:
                return self._again(context)
        window_manager = context.window_manager
        window_manager.progress_begin(0, 100)
        self._started = time.monotonic()
        try:
            work = self.prepare(context)
            result = work(
                progress=lambda stage, share: window_manager.progress_update(int(100 * share)), cancel=None
            )
            self.finish(context, result)
        except FAILURES as failure:
            return self._failed(failure)
        finally:
            window_manager.progress_end()
        return {"FINISHED"}

    def invoke(self, context, event):
        """From the interface: starts the work and returns; modal() waits for its end."""
        if bpy.app.background or context.window is None:
            return self.execute(context)
        self._started = time.monotonic()
        self._redone, Status.redone = Status.redone, False
        try:
            self._job = Job(self.prepare(context))
        except FAILURES as failure:
            return self._given_up(context, failure)
        window_manager = context.window_manager
        window_manager.progress_begin(0, 100)
        self._area, self._text = context.area, None
        self._timer = window_manager.event_timer_add(TICK_S, window=context.window)
        window_manager.modal_handler_add(self)
        Status.label = self.bl_label
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        job = self._job
        if event.type == "ESC":
            job.stop()
            job.thread.join(2 * TICK_S)
        elif event.type in VIEW and not event.ctrl:
            return {"PASS_THROUGH"}
        elif event.type != "TIMER":
            return {"RUNNING_MODAL"}  # swallowed: the scene must not change meanwhile
        if job.thread.is_alive():
            self._show(context, job)
            return {"RUNNING_MODAL"}
        self._hide(context)
        if job.failure is not None:
            if isinstance(job.failure, (Stopped, *FAILURES)):
                return self._given_up(context, job.failure)
            raise job.failure
        try:
            self.finish(context, job.result)
        except FAILURES as failure:
            return self._given_up(context, failure)
        return {"FINISHED"}

    def _again(self, context):
        """Redo: Blender has undone the last run, calls execute(), and where that ends without a result does
        what was undone once more. So it ends so; right after, the last run is undone for good and a modal
        run with the new settings begins. Where that is given up the last run comes back.
        """
        if Status.label:
            return {"CANCELLED"}
        window, area, undone = context.window, context.area, self.options.is_repeat
        settings = {}
        for key, value in self.as_keywords().items():
            items = isinstance(value, bpy.types.bpy_prop_collection)
            settings[key] = [{"name": item.name} for item in value] if items else value
        group, name = self.bl_idname.split("_OT_")  # as Blender keeps it
        operator = getattr(getattr(bpy.ops, group.lower()), name)
        region = next((r for r in area.regions if r.type == "WINDOW"), None) if area is not None else None

        def begin():
            with context_of(window, area, region):
                if undone:
                    bpy.ops.ed.undo()
                Status.redone = undone
                try:
                    operator("INVOKE_DEFAULT", True, **settings)
                except RuntimeError:
                    pass  # refused: reported, and what was undone comes back

        bpy.app.timers.register(begin, first_interval=0.0)
        return {"CANCELLED"}

    def _given_up(self, context, failure):
        """Of a modal run that ends without a result."""
        if self._redone:
            window, area = context.window, context.area

            def back():
                with context_of(window, area, None):
                    bpy.ops.ed.redo()

            bpy.app.timers.register(back, first_interval=0.0)
        return self._failed(failure)

    def cancel(self, context):
        """Blender ends the operator: its window was closed, another file is loaded."""
        self._job.stop()
        self._job.thread.join()
        self._hide(context)

    def seconds(self):
        """Since the operator began."""
        return time.monotonic() - self._started

    def _show(self, context, job):
        Status.stage, Status.share = job.stage, job.share
        Status.left = time_left(self.seconds(), job.share)
        context.window_manager.progress_update(int(100 * job.share))
        text = f"{self.bl_label}: {job.stage} {100 * job.share:.0f} %{Status.left}   (Esc cancels)"
        if text == self._text:
            return
        self._text = text
        context.workspace.status_text_set(text)
        if self._area is not None:
            self._area.header_text_set(text)
            # Not the view: drawing a large mesh again and again would slow everything down.
            self._redraw({"UI"})

    def _hide(self, context):
        Status.label = ""
        window_manager = context.window_manager
        window_manager.event_timer_remove(self._timer)
        window_manager.progress_end()
        context.workspace.status_text_set(None)
        if self._area is not None:
            self._area.header_text_set(None)
            self._area.tag_redraw()

    def _redraw(self, kinds):
        for region in self._area.regions:
            if region.type in kinds:
                region.tag_redraw()

    def _failed(self, failure):
        if isinstance(failure, (Stopped, atlasfit.Cancelled)):
            self.report({"WARNING"}, f"{self.bl_label}: cancelled, nothing was changed")
        else:
            text = str(failure) or type(failure).__name__
            self.report({"ERROR"}, f"{self.bl_label}: {text}")
        return {"CANCELLED"}
