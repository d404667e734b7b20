"""The base class of all configs, for pydantic 1 and 2.

It has the methods of both releases that copy or dump a config, and accepts classes written for either of them.
"""

from __future__ import annotations

import inspect
import json
import re
import sys
import warnings
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, ClassVar, Optional, Union, get_args, get_origin

import pydantic
from pydantic import BaseModel, ValidationError

__all__ = ["IS_PYDANTIC_1", "Model", "validation_error"]

IS_PYDANTIC_1 = pydantic.VERSION.startswith("1.")
_OPTIONAL_TEXT = r"(typing\.)?(Optional\[|Union\[.*\bNone\b)|.*\|\s*None\s*$|None\s*\|"


def _annotations(namespace: Mapping[str, Any]) -> dict[str, Any]:
    """Returns the annotations in the body of a class."""
    if sys.version_info >= (3, 14) and "__annotations__" not in namespace:
        import annotationlib

        annotate = annotationlib.get_annotate_from_class_namespace(namespace)
        if annotate is None:
            return {}
        return dict(annotationlib.call_annotate_function(annotate, annotationlib.Format.FORWARDREF))
    return dict(namespace.get("__annotations__", {}))


def _is_field(name: str, value: Any) -> bool:
    """Returns whether pydantic 1 turns an attribute without annotation into a field."""
    is_plain = not isinstance(value, type) and not hasattr(type(value), "__get__")
    return is_plain and name != "model_config" and not name.startswith("_")


def _inherited(name: str, bases: tuple) -> Any:
    """Returns the annotation of a field of the base classes."""
    fields = (getattr(base, "model_fields", {}).get(name) for base in bases)
    return next((field.annotation for field in fields if field is not None), None)


def _type_of(value: Any) -> Any:
    """Returns the type of a default."""
    if isinstance(value, FieldInfo):
        value = None if value.default is PydanticUndefined else value.default
    return Any if value is None else type(value)


def _is_optional(annotation: Any) -> bool:
    """Returns whether an annotation allows None; in pydantic 1, None is then the default."""
    if isinstance(annotation, str):
        return re.match(_OPTIONAL_TEXT, annotation) is not None
    is_union = get_origin(annotation) in (Union, type(int | str))
    return is_union and type(None) in get_args(annotation)


if TYPE_CHECKING or not IS_PYDANTIC_1:
    from pydantic import ConfigDict, model_validator
    from pydantic.fields import FieldInfo
    from pydantic.warnings import PydanticDeprecatedSince20
    from pydantic_core import InitErrorDetails, PydanticCustomError, PydanticUndefined

    if TYPE_CHECKING:
        # Pydantic's own metaclass is private.
        from pydantic._internal._model_construction import ModelMetaclass
    else:
        ModelMetaclass = type(BaseModel)

    _DUMP_OPTIONS = inspect.signature(BaseModel.model_dump).parameters.keys() - {"self", "mode"}

    class _Lenient(ModelMetaclass):
        """Gives the fields of a class written for pydantic 1 the annotations and defaults that pydantic 2 requires."""

        def __new__(mcs, name: str, bases: tuple, namespace: dict[str, Any], **settings: Any) -> type:
            annotations = _annotations(namespace)
            for field, value in namespace.items():
                if field not in annotations and _is_field(field, value):
                    annotations[field] = _inherited(field, bases) or _type_of(value)
            defaults = {field: None for field, kind in annotations.items() if _is_optional(kind)}
            given = {"__annotations__": annotations} if annotations else {}
            return super().__new__(mcs, name, bases, {**defaults, **namespace, **given}, **settings)

    class Model(BaseModel, metaclass=_Lenient):
        """A config that ignores unknown fields."""

        model_config = ConfigDict(extra="ignore", arbitrary_types_allowed=True, protected_namespaces=())

        @model_validator(mode="before")
        @classmethod
        def _without_none(cls, fields: Any) -> Any:
            # In pydantic 1, a field whose default is None accepts None, regardless of its annotation.
            if not isinstance(fields, Mapping):
                return fields
            known = cls.model_fields
            return {
                name: value
                for name, value in fields.items()
                if value is not None or name not in known or known[name].default is not None
            }

        def dict(self, **kwargs: Any) -> dict[str, Any]:
            """Returns all fields by name, like `model_dump`."""
            return self.model_dump(**kwargs)

        def json(self, *, encoder: Optional[Callable[[Any], Any]] = None, **kwargs: Any) -> str:
            """Returns all fields as JSON, formatted as in pydantic 1.

            The other arguments are those of `model_dump`, and those of `json.dumps`, such as `indent` and `sort_keys`.
            """
            options = {name: kwargs.pop(name) for name in _DUMP_OPTIONS & kwargs.keys()}
            fields = self.model_dump(mode="python" if encoder else "json", **options)
            return json.dumps(fields, default=encoder, **kwargs)

        def copy(self, *, include: Any = None, exclude: Any = None, **kwargs: Any) -> Any:
            """Returns a copy, like `model_copy`, with the fields `include` and without the fields `exclude`."""
            if include is None and exclude is None:
                return self.model_copy(**kwargs)
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", PydanticDeprecatedSince20)
                return super().copy(include=include, exclude=exclude, **kwargs)

        @classmethod
        def _aliases(cls) -> Mapping[str, str]:
            """Returns the field of each alias."""
            fields = cls.model_fields.items()
            # If a field has a `validation_alias`, pydantic accepts only that one in its input.
            aliases = ((field.validation_alias or field.alias, name) for name, field in fields)
            return {alias: name for alias, name in aliases if isinstance(alias, str) and alias != name}

        def _set_given_fields(self, names: set[str]) -> None:
            """Makes `exclude_unset` leave out the fields that were derived."""
            self.__pydantic_fields_set__ = names

        @classmethod
        def _extra(cls) -> str:
            return str(cls.model_config.get("extra"))

        @classmethod
        def _defaults(cls) -> Mapping[str, Any]:
            return {name: field.default for name, field in cls.model_fields.items() if not field.is_required()}

    def validation_error(
        model: type[BaseModel], reason: str, field: Optional[str], fields: Mapping[str, Any]
    ) -> ValidationError:
        """Returns the error that pydantic raises for a wrong field of a model, or for the whole model."""
        error = PydanticCustomError("pogema", "{text}", {"text": reason})
        place: tuple[str, ...] = (field,) if field else ()
        details = InitErrorDetails(type=error, loc=place, input=fields.get(field) if field else fields)
        return ValidationError.from_exception_data(model.__name__, [details])

else:
    from pydantic.error_wrappers import ErrorWrapper

    class _Fields:
        """A class attribute that returns the fields of its class by name."""

        def __get__(self, instance: Any, owner: Any) -> Any:
            return owner.__fields__

    class Model(BaseModel):
        """A config that ignores unknown fields."""

        class Config:
            """Allows fields of any type."""

            arbitrary_types_allowed = True

        model_fields: ClassVar[Any] = _Fields()

        def model_dump(self, **kwargs: Any) -> Any:
            """Returns all fields by name, like `dict`."""
            return self.dict(**kwargs)

        def model_dump_json(self, **kwargs: Any) -> str:
            """Returns all fields as JSON, like `json`."""
            return self.json(**kwargs)

        def model_copy(self, **kwargs: Any) -> Any:
            """Returns a copy, like `copy`."""
            return self.copy(**kwargs)

        @classmethod
        def _aliases(cls) -> Mapping[str, str]:
            """Returns the field of each alias."""
            return {field.alias: name for name, field in cls.__fields__.items() if field.alias != name}

        def _set_given_fields(self, names: set[str]) -> None:
            """Makes `exclude_unset` leave out the fields that were derived."""
            object.__setattr__(self, "__fields_set__", names)

        @classmethod
        def _extra(cls) -> str:
            return cls.__config__.extra.value

        @classmethod
        def _defaults(cls) -> Mapping[str, Any]:
            return {name: field.default for name, field in cls.__fields__.items() if not field.required}

    def validation_error(
        model: type[BaseModel], reason: str, field: Optional[str], fields: Mapping[str, Any]
    ) -> ValidationError:
        """Returns the error that pydantic raises for a wrong field of a model, or for the whole model."""
        return ValidationError([ErrorWrapper(ValueError(reason), field or "__root__")], model)
