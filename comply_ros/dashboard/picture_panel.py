# SPDX-License-Identifier: Apache-2.0
"""The picture of an environment of Gymnasium, as that draws itself."""

from nicegui import ui

from comply_ros.dashboard.dashboard_node import DashboardNode, PageState


class PicturePanel:
    """A picture that is there while a node publishes one; a visitor can switch it off."""

    def __init__(self, node: DashboardNode) -> None:
        self._node = node
        with ui.column().classes('panel') as self._panel:
            with ui.row().classes('w-full items-center gap-3 no-wrap'):
                ui.label('Environment').classes('panel-title grow')
                self._is_on = ui.switch('picture', value=True).props(
                    'dense data-testid=picture-switch')
            self._image = ui.interactive_image(events=[]).classes('picture').props(
                'data-testid=picture')
        self._panel.visible = False

    def show(self, state: PageState) -> None:
        """Show a state of the page."""
        is_on = state.has_pictures and self._is_on.value
        self._panel.visible = state.has_pictures
        self._image.visible = bool(is_on and state.picture)
        if is_on:
            self._node.pictures.want()
            if state.picture and self._image.source != state.picture:
                self._image.set_source(state.picture)
