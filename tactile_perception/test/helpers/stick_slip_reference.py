# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""States of dots in NumPy: what the compiled ones measure themselves against."""
import copy
from dataclasses import dataclass, field, replace

import cv2
import numpy as np

from tactile_perception.common.statistics import robust_sigma
from tactile_perception.touchpad.contact import stick_slip as compiled
from tactile_perception.touchpad.contact.stick_slip import NON_CONTACT, SLIPPING, STICKING
from twist_reference import DotMotions, across_rays, lengths, twist_about

_FEWEST = 2  # dots that tell a motion, as turns are held back; chosen: those of a light touch
_SMOOTHING = 0.2  # weight of a new value in the running means of noise and friction; chosen
# Frames for which dots must be at rest before an object rests that slid, and one that turned in place, where the dots' motions do not tell
# that it stopped; chosen.
_REST_AFTER_GROSS, _REST_AFTER_TURN = 3, 15
_QUIET = 1 / 3  # of the tolerance: dots that move less in a frame are at rest; chosen
_STARTS = 0.75  # of the tolerance: dots of an object at rest after gross slip that move less stay at rest; chosen
_SWIFT = 50  # tolerances: an object that slides over its dots by more in a frame moves some in each; chosen
_BRISK, _ENOUGH = 12, 20  # tolerances and dots: such an object that slides on by more in a frame takes its region along visibly; chosen
_TAKEN = 0.3  # share of that way by which its region has to move at least; chosen
_FADING = 0.5  # share of the liveliness that is left a frame later; chosen
_LIVELY = 3  # tolerances: dots that moved by more just before they came to rest were stopped; chosen
_SUDDEN = 0.5  # share of what an even fading leaves of the dots' mean motion: if less is left, the object stops; chosen
_CLEAR = 5  # standard deviations of noise above which the dots' mean motion is clear; chosen
_ONE_WAY = 0.5  # of the sum of the drags' lengths: drags with a smaller sum are those of a turn; chosen
_ALONG = 0.5  # mean cosine between lags and drags from which dots slip grossly; half of it while they do; chosen
_LOADED = 0.65  # of the friction coefficient: ratio from which dots may slip grossly; chosen
_LEAST_FRICTION = 0.05  # friction coefficient; smaller estimates are not used; chosen
_MANY = 0.1  # share of slipping dots from which gross slip may follow; chosen
_ALL = 0.9  # share of dots that move as one body, from which an object that starts or stops holds them; chosen
_TIGHT = 0.15  # of the tolerance: dots that stick move with their object within that; chosen
_HELD = 0.25  # share of dots, four or more, that move so and tell that the object holds them; chosen
_FEW_SLIP = 0.6  # share of slipping dots below which an object that slows down is told from one that slips; chosen
_LIFTS = 2  # noises along the normal by which an object that is lifted rises in a frame at least; chosen
_BACK = 0.7  # mean cosine between their motions and -drags from which dots spring back; chosen
_TWELVE = 12  # dots that tell the noise along the normal: twice the unknowns of their motion
_LAG = 0.4  # of the tolerance: standard deviation of a sticking dot's lag behind its object; chosen
_CALMEST = 5  # the quantile 1/5 of the motions is used as noise, of which it is 0.668 standard deviations (2D Gaussian: sqrt(-2 ln 0.8))


@dataclass
class _Object:
    """What is known of one object from its last frame.

    twist (6,), a frame, about centre (3,), m, None: unknown; friction: coefficient; slipping: share of its dots that slip; gross: whether
    it slips grossly; rests: whether it has stopped after gross slip, of which twist then is the last; still: frames for which its dots have
    been at rest; slid: frames for which it has slipped grossly; lively: m, motion of its
    dots, in the last few in which they moved; drift: (9,) m, sizes of the dots' mean motion in the last frames, the newest first; lost:
    whether none of them was touched in the last frame; taken: share of its expected way by which its region moved; calm: whether the dots
    move by no more than their noise.
    """

    friction: float
    twist: np.ndarray | None = None
    centre: np.ndarray | None = None
    slipping: float = 0.0
    gross: bool = False
    rests: bool = False
    still: int = 0
    slid: int = 0
    lively: float = 0.0
    drift: np.ndarray = field(default_factory=lambda: np.zeros(9))
    lost: bool = False
    taken: float = np.nan
    calm: bool = False


class StickSlipTracker(compiled.StickSlipTracker):
    """Its states, computed dot by dot in NumPy."""

    def reset(self):
        """Forget all frames."""
        self._last: tuple[np.ndarray, np.ndarray, np.ndarray] | None = None
        self._objects: list[_Object] = []
        self._held = np.zeros(self.shape[0] * self.shape[1], int)
        self.friction = np.nan

    def update(self, state, score: np.ndarray) -> np.ndarray:
        """States (K,) uint8 in this frame; score (K,): above 0.5 in contact."""
        touched = score > .5
        if not touched.any():
            self.observe_free(state.xyz, state.seen)
            return np.zeros(len(score), np.uint8)
        states, held, objects = np.where(touched, STICKING, NON_CONTACT).astype(np.uint8), np.zeros(len(score), int), []
        known = state.seen & self._last[1] if self._last else np.zeros(len(score), bool)
        for member in self._separate(touched):
            thing, both = self._continued(member), member[known[member] & (self._held[member] > 0)]
            if len(both):
                states[both[self._classify(thing, state, score, both)]] = SLIPPING
                states[member[self._held[member] == 0]] = SLIPPING if thing.gross else STICKING
            thing.lost = False
            objects.append(thing)
            held[member] = len(objects)
        for number, thing in enumerate(self._objects, 1):
            before = self._held == number
            if not thing.lost and not touched[before].any():
                objects.append(replace(thing, lost=True))
                held[before] = len(objects)
        self._last, self._objects, self._held = (state.xyz, state.seen, score), objects, held
        return states

    def observe_free(self, xyz: np.ndarray, seen: np.ndarray) -> None:
        """A frame without contact: dots at xyz (K, 3) m; seen: (K,) bool. Forgets lost objects and updates the noise by motions."""
        if self._last is not None and not self._objects:
            moved = lengths(across_rays(self._last[0], xyz, self.origin)[0])[seen & self._last[1]]
            # a low quantile: a touch below the detection limit moves many dots
            here = np.partition(moved, len(moved) // _CALMEST)[len(moved) // _CALMEST] / 0.668 if len(moved) else np.nan
            if here > 0:
                self.noise += (_SMOOTHING if here < self.noise else _SMOOTHING / 4) * (here - self.noise)
        if all(thing.lost for thing in self._objects):
            self._objects, self._held = [], np.zeros(len(seen), int)
        self._last, self._objects = (xyz, seen, np.zeros(len(seen))), [replace(thing, lost=True) for thing in self._objects]

    def _separate(self, touched: np.ndarray) -> list[np.ndarray]:
        """Numbers (N,) of the dots of each separate object, largest first: dots with up to one free dot between them belong together."""
        wide = cv2.dilate(touched.reshape(self.shape).astype(np.uint8), np.ones((2, 2), np.uint8))
        count, label = cv2.connectedComponents(wide)
        label = np.where(touched, label.ravel(), 0)
        return sorted((np.flatnonzero(label == number) for number in range(1, count)), key=len, reverse=True)

    def _continued(self, member: np.ndarray) -> _Object:
        """The object of the last frame that held most of the dots member (N,); a new one if none did."""
        before = np.bincount(self._held[member], minlength=len(self._objects) + 1)[1:]
        return copy.copy(self._objects[before.argmax()]) if before.any() else _Object(self.friction)

    def _classify(self, thing, state, score, both):
        """(N,) bool: which of the dots both (N,), in contact and seen now and in the last frame, slip."""
        across = np.hypot(self.noise, _LAG * self.tolerance)
        motions = DotMotions(self._last[0][both], state.xyz[both], state.normal[both], self.origin, across, self.depth_noise)
        new = thing.twist is None
        predicted = self._lowered(motions) if new else twist_about(thing.twist, thing.centre, motions.centre)
        if not new and not self._in_touch(motions, predicted):
            predicted = motions.constrained_to_normals(predicted)
        ratio, drag = self._friction(state, score > 0.5, both, motions, None if new else predicted)
        self._watch_rest(thing, motions, predicted)
        thing.taken = self._taken_along(motions, predicted, drag, state.xyz, score, both)
        starts = new and self._starts_sliding(thing, motions, predicted, ratio, drag)
        twist, thing.gross, thing.rests = ((predicted, True, False) if starts else
                                           self._motion(thing, motions, None if new else predicted, ratio, drag))
        if len(both) < _FEWEST and not thing.gross:
            vars(thing).update(vars(_Object(thing.friction)))
            return np.zeros(len(both), bool)
        slips = lengths(motions.residuals(twist)) > self._slip_limit()
        self._learn(thing, motions, twist, ratio, slips)
        if not starts:
            thing.twist, thing.centre, thing.slipping = predicted if thing.rests else twist, motions.centre, slips.mean()
        return slips

    def _slip_limit(self):
        """Lag behind the object, m a frame, above which a dot slips."""
        return np.hypot(1.3 * self.tolerance, 3 * self.noise)

    def _lowered(self, motions):
        """Motion (6,) along the sensor's axis that follows the dots along their normals."""
        upright = motions.normal_rows[:, 2]
        return np.array([0, 0, upright @ motions.normal_residuals(np.zeros(6)) / (upright @ upright), 0, 0, 0])

    def _starts_sliding(self, thing, motions, predicted, ratio, drag):
        """Whether the dots of a new object lag along their drag behind an object that moves along the sensor's axis alone."""
        size = lengths(motions.residuals(predicted)).mean()
        return size > self._slip_limit() and self._lag_along_drag(motions, predicted, drag) > _ALONG and self._loaded(thing, ratio)

    def _motion(self, thing, motions, predicted, ratio, drag):
        """The object's twist (6,), whether it slips grossly, and whether it rests after that."""
        fine = self.tolerance
        grip = np.clip((thing.friction - ratio) / (.4 * thing.friction), .05, 1)**2 if thing.friction > 0 else np.ones(len(ratio))
        creeps = thing.rests and self._creeps(thing, motions, drag)
        if creeps:
            thing.still = 0
        if thing.still >= self._rest_frames(thing, motions, predicted, drag):
            return np.zeros(6), False, thing.gross or thing.rests
        moved = lengths(motions.residuals(np.zeros(6))).mean()
        if thing.rests and not creeps and moved < _STARTS * self.tolerance and self._in_touch(motions, np.zeros(6)):
            return np.zeros(6), False, True
        if thing.rests and self._slides_again(thing, motions, predicted, ratio, drag):
            return predicted, True, False
        if predicted is not None and not thing.rests:
            near = motions.fit_robust(predicted, drag, 4 * fine, fine, max(1.0, .1 * len(ratio)), grip)
            agree = self._following(motions, near)
            slides = self._slides_on(thing, motions, predicted, ratio, drag)
            if not thing.gross and self._lead(motions, predicted, drag) > self.tolerance:
                whole = motions.fit_robust(None, drag, 30 * fine, fine, 0.0, grip)
                if self._in_touch(motions, whole):
                    return whole, False, False
            if not thing.gross and agree < (1 - _MANY) * len(ratio):
                whole = motions.fit_robust(None, drag, 30 * fine, fine, 0.0, grip)
                follow = not slides and self._following(motions, whole) > _ALL * len(ratio)
                if (follow or self._slows_down(thing, motions, near, whole)) and self._in_touch(motions, whole):
                    return whole, False, False
            if agree >= max(_FEWEST - 1, .1 * len(ratio)) and not thing.gross and self._in_touch(motions, near) and not (
                    slides and self._behind(motions, near, predicted, drag)):
                return near, False, False
            if slides:
                return predicted, True, False
        whole, straight = motions.fit_robust(None, drag, 30 * fine, fine, 0.0, grip), motions.constrained_to_normals(np.zeros(6))
        back = self._spring_back(motions, drag) or self._lowered(motions)[2] > _LIFTS * self.depth_noise
        if (thing.rests and back and self._held_by(motions, whole) < _HELD * len(ratio) and self._in_touch(motions, straight)):
            return straight, True, False
        return whole, False, False

    def _spring_back(self, motions, drag):
        """Whether the dots move back against their drags."""
        moved = motions.residuals(np.zeros(6))
        along = (np.einsum('ij,ij->i', moved, drag) / np.maximum(lengths(drag), 1e-12)).sum()
        size = (lengths(moved) + 1e-12).sum()
        return along < -_BACK * size and size > self._slip_limit() * len(drag)

    def _held_by(self, motions, twist):
        """Number of dots that move with an object of this twist as precisely as those that stick to it do; 0 for fewer than four."""
        count = np.count_nonzero(lengths(motions.residuals(twist)) < _TIGHT * self.tolerance)
        return count if count >= 4 else 0

    def _slows_down(self, thing, motions, near, whole):
        """Whether the object has slowed down, to a twist by which it still holds dots, instead of sliding on."""
        stuck = (1 - thing.slipping) * len(motions.moved_across)
        return thing.slipping < _FEW_SLIP and self._held_by(motions, whole) > max(self._held_by(motions, near), _HELD * stuck)

    def _following(self, motions, twist):
        """Number of dots that move with an object of this twist."""
        return np.count_nonzero(lengths(motions.residuals(twist)) < 1.3 * self.tolerance)

    def _lead(self, motions, predicted, drag):
        """Mean motion of the dots along their drag beyond the predicted one, m a frame: dots cannot lead their object, it has sped up."""
        pull = drag.sum(axis=0)
        return motions.residuals(predicted).mean(axis=0) @ pull / max(np.linalg.norm(pull), 1e-12)

    def _behind(self, motions, near, predicted, drag):
        """Whether the motion that most dots share lags behind the predicted one along the drag: then these dots slip, they do not stick."""
        lag = (motions.residuals(near) - motions.residuals(predicted)).mean(axis=0)
        return lag @ drag.sum(axis=0) > 2 * self.tolerance * np.linalg.norm(drag.sum(axis=0))

    def _slides_again(self, thing, motions, predicted, ratio, drag):
        """Whether the dots of an object that rested after gross slip move as in gross slip again: not back against their drags."""
        moved = np.vdot(motions.residuals(np.zeros(6)), drag)
        return (moved > -0.5 * self.tolerance * lengths(drag).sum() and self._loaded(thing, ratio)
                and self._in_touch(motions, predicted))

    def _watch_rest(self, thing, motions, predicted):
        """Count the frames in which the dots are at rest: within three standard deviations of noise, or far below the tolerance; and those
        of gross slip, and note how far the dots move."""
        across = motions.moved_across
        size = np.sqrt(np.vdot(across, across) / len(across))
        thing.calm = size**2 / (2 * self.noise**2) - 1 < 3 / np.sqrt(len(across))
        # Dots under an object that slid fast creep on a little when it stops.
        swift = thing.gross and predicted is not None and lengths(motions.residuals(predicted)).mean() > _SWIFT * self.tolerance
        if (thing.calm or size < (1 if swift else _QUIET) * self.tolerance) and self._in_touch(motions, np.zeros(6)):
            thing.still += 1
        else:
            thing.still, thing.lively = 0, max(size, _FADING * thing.lively)
        thing.drift = np.append(np.linalg.norm(across.mean(axis=0)), thing.drift[:-1])
        thing.slid = thing.slid + 1 if thing.gross else 0

    def _rest_frames(self, thing, motions, predicted, drag):
        """Frames for which dots must be at rest before the object counts as at rest."""
        if not thing.gross or lengths(motions.residuals(predicted)).mean() > _SWIFT * self.tolerance:
            return 1
        if len(drag) >= _ENOUGH and thing.taken < _TAKEN:
            return 1
        if thing.calm and thing.lively > self.tolerance and not thing.taken >= _TAKEN:
            return 1
        return _REST_AFTER_TURN if self._turns(drag) and not self._stopped(thing, len(drag)) else _REST_AFTER_GROSS

    def _taken_along(self, motions, predicted, drag, places, score, both):
        """Share of the way that the object was expected to slide by which its region moves over the dots; NaN: unknown."""
        lag = -motions.residuals(predicted).mean(axis=0)
        if np.linalg.norm(lag) < _BRISK * self.tolerance or self._turns(drag):
            return np.nan
        near = np.zeros(self.shape, np.uint8)
        near.flat[both] = 1
        near = cv2.dilate(near, np.ones((3, 3), np.uint8)).ravel() > 0
        if not self._last[2][near].any():
            return np.nan
        centres = [np.average(places[near], axis=0, weights=weight[near]) for weight in (self._last[2], score)]
        return (centres[1] - centres[0]) @ lag / (lag @ lag)

    def _turns(self, drag):
        """Whether the dots are dragged as below an object that turns in place."""
        return np.linalg.norm(drag.sum(axis=0)) < _ONE_WAY * lengths(drag).sum()

    def _clear(self, count):
        """Mean motion, m a frame, of count dots, that is more than noise."""
        return _CLEAR * self.noise * np.sqrt(2 / count)

    def _stopped(self, thing, count):
        """Whether the dots' motions in the last frames tell that an object that turned has stopped."""
        new, middle, old = np.median(thing.drift.reshape(3, 3), axis=1)
        return thing.lively > _LIVELY * self.tolerance or (
            thing.slid >= 9 and thing.drift[0] < self._clear(count) < middle and new * old < _SUDDEN * middle**2)

    def _creeps(self, thing, motions, drag):
        """Whether dots that hardly move drift, not back against their drags, below an object that turns in place."""
        back = np.einsum('ij,ij->i', motions.moved_across, drag / np.maximum(lengths(drag), 1e-12)[:, None]).mean()
        return self._turns(drag) and thing.drift[0] > max(self._clear(len(drag)), -back)

    def _in_touch(self, motions, twist):
        """Whether the dots follow the object along the normal, as all dots in contact must."""
        off = motions.normal_residuals(twist)
        return abs(np.median(off)) < 2 * self.depth_noise and np.median(np.abs(off)) < 3 * self.depth_noise

    def _slides_on(self, thing, motions, predicted, ratio, drag):
        """Whether the dots lag behind the predicted motion as in gross slip: all along their drag, at the friction of earlier slip."""
        dragged = self._lag_along_drag(motions, predicted, drag) > (_ALONG / 2 if thing.gross else _ALONG)
        return bool(dragged and self._loaded(thing, ratio) and self._in_touch(motions, predicted)
                    and (thing.gross or thing.slipping > _MANY))

    def _lag_along_drag(self, motions, predicted, drag):
        """Mean cosine, weighted by their size, between the dots' lags behind the predicted motion and their drags."""
        lag = -motions.residuals(predicted)
        along = np.einsum('ij,ij->i', lag, drag) / np.maximum(lengths(drag), 1e-12)
        return along.sum() / (lengths(lag) + 1e-12).sum()

    def _loaded(self, thing, ratio):
        """Whether the dots are dragged about as much as in earlier slip."""
        return not thing.friction > 0 or np.median(ratio) > _LOADED * thing.friction

    def _learn(self, thing, motions, twist, ratio, slips):
        """Update the running means of the slipping dots' friction and of the noise along the normal."""
        spread = robust_sigma(motions.normal_residuals(motions.constrained_to_normals(twist)))
        if len(slips) >= _TWELVE:
            self.depth_noise += _SMOOTHING * (max(spread, self.tolerance / 2) - self.depth_noise)
        seen = np.median(ratio[slips]) if slips.sum() >= _FEWEST else 0.0
        if seen > _LEAST_FRICTION:
            thing.friction = seen if not thing.friction > 0 else thing.friction + _SMOOTHING * (seen - thing.friction)
            self.friction = thing.friction

    def _friction(self, state, touched, both, motions, predicted):
        """Ratio (N,) of tangential to normal load, and tangential load (N, 3), of the dots both (N,), summed over 3 x 3 dots.

        Where the object slides over the surface, only the load in that direction counts: it may differ from dot to dot.
        """
        normal = -np.einsum('ij,ij->i', state.force, state.normal)
        loads = np.empty((len(normal), 5))
        loads[:, 0] = normal
        loads[:, 1:4] = state.force + normal[:, None] * state.normal
        loads[~touched] = 0
        direction = self._sliding_direction(motions, predicted, state.normal[both])
        loads[:, 4] = 0
        loads[both, 4] = np.einsum('ij,ij->i', loads[both, 1:4], direction)
        around = cv2.boxFilter(loads.reshape(*self.shape, 5), -1, (3, 3), normalize=False, borderType=cv2.BORDER_CONSTANT)
        near = around.reshape(-1, 5)[both]
        load = np.where(direction.any(1), near[:, 4], lengths(near[:, 1:4]))
        return load / np.maximum(near[:, 0], 1e-9), near[:, 1:4]

    def _sliding_direction(self, motions, predicted, normals):
        """Unit vectors (N, 3) along which the object, by the twist predicted, slides over the dots, across normals (N, 3); 0: unknown."""
        if predicted is None:
            return np.zeros_like(normals)
        lag = -motions.residuals(predicted)
        lag -= np.einsum('ij,ij->i', lag, normals)[:, None] * normals
        size = lengths(lag)[:, None]
        return np.where(size > self.tolerance / 2, lag / np.maximum(size, 1e-12), 0)
