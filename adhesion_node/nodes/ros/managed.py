# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The life cycle of a node as ROS 2 manages it: configured, activated, deactivated, cleaned up."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from functools import partial
from itertools import chain
from typing import Any

from lifecycle_msgs.srv import ChangeState
from rclpy.lifecycle import LifecycleState, TransitionCallbackReturn
from rclpy.lifecycle.node import LifecycleNodeMixin

from adhesion_node.core.atp.supervision import Severity
from adhesion_node.wire.settings.shared import AUTOSTART

from .diagnostics import Finding, Told
from .params import SettingsNode

UNCONFIGURED = "unconfigured: nothing is subscribed or published; configure and activate this node"
INACTIVE = "inactive: nothing is taken in or published; activate this node"
FINALIZED = "finalized: this node is at its end; start it anew"

Change = Callable[[ChangeState.Request, ChangeState.Response], ChangeState.Response]


class ManagedNode(LifecycleNodeMixin, SettingsNode, ABC):
    """Works while it is `active`; /diagnostics, which `told` says in whatever state, is not part of the life cycle.

    What `open` makes, topics, services and timers, is destroyed when the node is cleaned up.
    """

    def __init__(self, name: str, **kwargs: Any) -> None:
        SettingsNode.__init__(self, name, automatically_declare_parameters_from_overrides=True, **kwargs)
        LifecycleNodeMixin.__init__(self)
        self.configured = self.active = False
        self._failure: Exception | None = None
        self._made: set[Any] = set()
        """By `open`; all else is there in every state, a /clock that is switched on on the way as well."""
        service = self._service_change_state
        service.callback = partial(self._if_possible, service.callback)

    def bring_up(self, values: Mapping[str, Any]) -> None:
        """Configure and activate, unless a manager does; raises what `open` does. Call at the end of `__init__`."""
        if values[AUTOSTART.name]:
            self.trigger_configure()
            if self._failure is not None:
                raise self._failure
            self.trigger_activate()

    @abstractmethod
    def open(self) -> None:
        """Make what the node works with, from its parameters; what was known before is forgotten."""

    @abstractmethod
    def resume(self) -> None:
        """Begin to work."""

    def destroy_node(self) -> None:
        """Leave the graph at once: the state machine would hold the node until it is collected as garbage."""
        SettingsNode.destroy_node(self)
        self._state_machine.destroy_when_not_in_use()

    def standing(self, told: Callable[[], Told]) -> Told:
        """What there is to tell: while the node does not work, that it does not."""
        if self.active:
            return told()
        state = FINALIZED if self._state_machine.current_state[1] == "finalized" else UNCONFIGURED
        return [Finding(Severity.WARN, INACTIVE if self.configured else state)], {}

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Open; where something stands against that the node stays as it was and says what."""
        del state
        self._failure, before = None, self._entities()
        try:
            self.open()
        except Exception as error:  # rclpy would swallow it
            self._failure = error
            self.get_logger().error(f"not configured: {error}")
        self._made = self._entities() - before
        if self._failure is not None:
            self._destroy()
            return TransitionCallbackReturn.FAILURE
        self.configured = True
        return TransitionCallbackReturn.SUCCESS

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Begin to work."""
        del state
        self.resume()
        self.active = True
        return TransitionCallbackReturn.SUCCESS

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Cease to work."""
        del state
        self.active = False
        return TransitionCallbackReturn.SUCCESS

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Give up what `open` made."""
        del state
        self.configured = self.active = False
        self._destroy()
        return TransitionCallbackReturn.SUCCESS

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Give up what `open` made, if it was."""
        return self.on_cleanup(state)

    def _if_possible(self, change: Change, request: ChangeState.Request, response: ChangeState.Response) -> Any:
        """Refuse a transition that the state does not have: rclpy would let the node die of it."""
        asked, possible = request.transition, [one[:2] for one in self._state_machine.available_transitions]
        if asked.label or asked.id in dict(possible):  # by its label rclpy itself refuses
            return change(request, response)
        there = ", ".join(f"{number} {label}" for number, label in possible) or "nothing"
        self.get_logger().warning(f"transition {asked.id}: not from here: ask for {there}")
        response.success = False
        return response

    def _entities(self) -> set[Any]:
        return set(chain(self.publishers, self.subscriptions, self.services, self.timers))

    def _destroy(self) -> None:
        for present, destroy in (
            (list(self.timers), self.destroy_timer),
            (list(self.subscriptions), self.destroy_subscription),
            (list(self.services), self.destroy_service),
            (list(self.publishers), self.destroy_publisher),
        ):
            for one in self._made.intersection(present):
                destroy(one)
