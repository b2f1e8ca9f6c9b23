"""Offer to read a mesh another way, where what was read is unlikely."""

from __future__ import annotations

from sd2app.session.document import DocumentModel
from sd2app.session.undo import Edits
from sd2app.widgets.notices import Notice


class MeshOffer(Notice):
    """What is unlikely about the mesh, and a button for what would put it right."""

    def __init__(self, document: DocumentModel, edits: Edits) -> None:
        tip = "Read the mesh again so; undo takes it back, File → Save keeps it"
        buttons = (("cure", "Read it so", tip, self._accept),)
        super().__init__("Mesh that is unlikely", buttons, document.decline_offers)
        self._document, self._edits = document, edits
        document.offered.connect(self._refresh)

    def _accept(self) -> None:
        document = self._document
        if document.offers:
            read = self._edits.cure_mesh if document.offers_of_open else document.open_mesh_so
            read(document.offers[0].cure)

    def _refresh(self) -> None:
        offers = self._document.offers
        if offers:
            self.buttons["cure"].setText(offers[0].cure.words)
        self.show_words("The mesh is unlikely" if offers else "", offers[0].text if offers else "")
