"""The protocol of scikit-learn's estimators, without importing scikit-learn."""

from __future__ import annotations

import copy
import importlib
import inspect
from typing import Any, TypeVar

from ._errors import InputError

_Self = TypeVar("_Self", bound="Estimator")


class Estimator:
    """Parameters by name, and metadata routing, for `sklearn.base.clone`, searches and meta-estimators."""

    @classmethod
    def _defaults(cls) -> dict[str, Any]:
        """The arguments with their defaults."""
        arguments = inspect.signature(cls.__init__).parameters.values()
        return {argument.name: argument.default for argument in arguments if argument.name != "self"}

    def get_params(self, deep: bool = True) -> dict[str, Any]:
        """The arguments, for `sklearn.base.clone` and searches."""
        params = {name: getattr(self, name) for name in self._defaults()}
        for name, value in list(params.items()):
            if deep and hasattr(value, "get_params") and not isinstance(value, type):
                params |= {f"{name}__{inner}": own for inner, own in value.get_params().items()}
        return params

    def set_params(self: _Self, **params: Any) -> _Self:
        """Sets arguments by name; `estimator__depth` is the `depth` of the `estimator`."""
        # An estimator before its own arguments.
        for name, value in sorted(params.items(), key=lambda param: "__" in param[0]):
            own, _, inner = name.partition("__")
            if own not in self._defaults():
                raise InputError(f"a {type(self).__name__} has no {own}. Use {', '.join(self._defaults())}.")
            if inner:
                getattr(self, own).set_params(**{inner: value})
            else:
                setattr(self, own, value)
        return self

    def set_fit_request(self: _Self, **requested: bool | str | None) -> _Self:
        """States which arguments of `fit` a meta-estimator hands on, such as `sequence=True`, for scikit-learn's metadata routing."""
        return self._request("fit", requested)

    def set_predict_request(self: _Self, **requested: bool | str | None) -> _Self:
        """The same for `predict`."""
        return self._request("predict", requested)

    def set_score_request(self: _Self, **requested: bool | str | None) -> _Self:
        """The same for `score`."""
        return self._request("score", requested)

    def _request(self: _Self, method: str, requested: dict[str, bool | str | None]) -> _Self:
        requests = self.get_metadata_routing()
        own = getattr(requests, method)
        for name, alias in requested.items():
            if name not in own.requests:
                raise InputError(f"`{method}` has no argument {name} to route. Use {', '.join(own.requests)}.")
            own.add_request(param=name, alias=alias)
        self._metadata_request = requests
        return self

    def get_metadata_routing(self) -> Any:
        """The arguments that a meta-estimator hands on, as scikit-learn's `MetadataRequest`."""
        if hasattr(self, "_metadata_request"):
            return copy.deepcopy(self._metadata_request)
        requests = importlib.import_module("sklearn.utils.metadata_routing").MetadataRequest(owner=type(self).__name__)
        for method in ("fit", "predict", "score"):
            for name in inspect.signature(getattr(self, method)).parameters.keys() - {"X", "y"}:
                getattr(requests, method).add_request(param=name, alias=None)
        return requests

    def __repr__(self) -> str:
        given = [(name, getattr(self, name), default) for name, default in self._defaults().items()]
        shown = ", ".join(f"{name}={value!r}" for name, value, default in given if repr(value) != repr(default))
        return f"{type(self).__name__}({shown})"
