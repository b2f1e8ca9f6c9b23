"""The synthetic map of some parts of the body alone."""

from __future__ import annotations

from PySide6.QtCore import QObject, Signal

from sd2app.background.latest import LatestRunner, ReportingModel
from sd2app.maps.model import SynthesisModel
from sd2app.session.session import Session
from sd2core.body.parts import body_parts
from sd2core.maps import OF
from sd2core.mesh.made_vertices import same_bodies
from sd2core.mesh.sequence import MeshSequence
from sd2core.mesh.vertex_parts import PARTS, WHOLE, VertexParts


class LimbsModel(ReportingModel):
    """Parts of the body that are shown alone, and the split of the synthetic map meanwhile.

    Menu and 3D view choose by this model.
    """

    changed = Signal()  # what is shown, or whose parts are known

    def __init__(self, session: Session, synthesis: SynthesisModel, parent: QObject) -> None:
        super().__init__(parent)
        self.track, self._synthesis = session.maps.synthetic, synthesis
        self._document = session.document
        self._mesh_parts: tuple[MeshSequence, VertexParts | None] | None = None
        self._finder = LatestRunner("limbs", self, self._take, self._fail)
        synthesis.completed.connect(self._check)
        session.document.opened.connect(self.show)
        session.document.changed.connect(self._leave_out)

    @property
    def parts(self) -> tuple[str, ...]:
        """Parts that are shown alone; none for the whole body."""
        return self.track.parts

    @property
    def persons(self) -> tuple[str, ...]:
        """Names of the people in a scene of several; empty of one alone."""
        mesh = self._document.mesh
        return mesh.persons if mesh is not None and mesh.others else ()

    @property
    def all_parts(self) -> tuple[str, ...]:
        """Parts that can be shown alone: of the body, or of several people each and their parts."""
        persons = self.persons
        limbs = [f"{person}{OF}{part}" for person in persons for part in PARTS]
        return *persons, *(limbs or PARTS)

    def show(self, *parts: str) -> None:
        """Show some parts or people alone, or (none given) everything.

        Whoever is shown is not shown in parts as well.
        """
        chosen = tuple(
            one
            for one in self.all_parts
            if one in parts and (one in self.persons or one.rpartition(OF)[0] not in parts)
        )
        if chosen != self.parts:
            self.track.set_parts(chosen)
            self._synthesis.want_limbs("parts shown", bool(chosen))
            self.changed.emit()

    def toggle(self, part: str) -> None:
        """Show one part more, or one less."""
        self.show(*({part} ^ {*self.parts}))

    def pick(self, part: str | None, *, adds: bool) -> None:
        """Show what was clicked alone, or with the others; whatever is no part ends it."""
        if part is not None and adds:
            self.toggle(part)
        elif not adds:
            self.show(*(() if part is None or self.parts == (part,) else (part,)))

    def part_of(self, vertex: int, body: int = 0) -> str | None:
        """Part that a vertex of a body, the first is 0, belongs to; None while that is unknown."""
        known, person = self.vertex_parts, self.persons[body : body + 1]
        if known is None:
            return None
        its = (known, *known.others)[body]
        name = its.names[its.numbers[vertex]]
        return OF.join([*person, name]) if name != WHOLE else "".join(person) or None

    @property
    def vertex_parts(self) -> VertexParts | None:
        """Parts of the bodies by vertex; looked for in the background when first asked for."""
        mesh = self._document.mesh
        if mesh is None:
            return None
        if self._mesh_parts is None or not same_bodies(self._mesh_parts[0], mesh):
            self._mesh_parts = mesh, None
            self._finder.submit(lambda _: (mesh, body_parts(mesh)))
        return self._mesh_parts[1]

    def _take(self, mesh_parts: tuple[MeshSequence, VertexParts | None]) -> None:
        self._mesh_parts = mesh_parts
        self.changed.emit()

    def _leave_out(self) -> None:
        """Show no part of who is no longer in the scene, or is called otherwise."""
        if not {*self.parts} <= {*self.all_parts}:
            self.show(*self.parts)

    def _check(self) -> None:
        known = self._synthesis.split and len(self.track.split) == len(self.parts)
        if self.parts and self._synthesis.complete and not known:
            self.show()
            self.failed.emit(
                "This mesh cannot be split by the parts of the body: it needs the closed surface"
                " of one whole body, with faces."
            )
