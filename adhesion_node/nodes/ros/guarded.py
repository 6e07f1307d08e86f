# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A node that outlives what rclpy would let it die of: anybody on the network may send it."""

from collections.abc import Callable
from functools import partial
from typing import Any

from rcl_interfaces.msg import SetParametersResult
from rcl_interfaces.srv import SetParameters, SetParametersAtomically
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.subscription import Subscription
from rclpy.time_source import TimeSource


class GuardedNode(Node):
    """Refuses a parameter whose type is none, and passes over a /clock below 0."""

    def __init__(self, name: str, **kwargs: Any) -> None:
        super().__init__(name, **kwargs)
        for service in self.services:
            if service.srv_type in (SetParameters, SetParametersAtomically):
                service.callback = partial(_of_known_types, service.callback)

    def create_subscription(self, msg_type: Any, topic: str, callback: Any, *args: Any, **kwargs: Any) -> Subscription:
        """Subscribe, with a guard before rclpy's own callback of /clock."""
        if isinstance(getattr(callback, "__self__", None), TimeSource):
            callback = partial(self._take_clock, callback)
        return super().create_subscription(msg_type, topic, callback, *args, **kwargs)

    def _take_clock(self, take: Callable[[Any], None], message: Any) -> None:
        if message.clock.sec >= 0:
            take(message)
        else:
            self.get_logger().warning(f"/clock = {message.clock.sec} s: not used; a time is 0 or more", once=True)


def _of_known_types(answer: Callable[[Any, Any], Any], request: Any, response: Any) -> Any:
    """Refuse a request with a value of a type that is none."""
    types = {kind.value for kind in Parameter.Type}
    strange = [(one.name, one.value.type) for one in request.parameters if one.value.type not in types]
    if not strange:
        return answer(request, response)
    reason = "; ".join(f"{name}: type = {number}: no parameter has it" for name, number in strange)
    result = SetParametersResult(successful=False, reason=reason)
    if isinstance(response, SetParametersAtomically.Response):
        response.result = result
    else:
        response.results = [result] * len(request.parameters)
    return response
