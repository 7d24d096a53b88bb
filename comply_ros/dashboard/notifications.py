# SPDX-License-Identifier: Apache-2.0
"""What a page says to the person when something cannot be done."""

import asyncio

from nicegui import background_tasks, context, ui

from comply_ros.dashboard.service_client import NoAnswerError


def complain(text):
    """Show one sentence on the page for some seconds."""
    ui.notify(text, type='negative', position='top', multi_line=True, timeout=7000)


def say_if_refused(future):
    """Show why, if what a `MentorThread` was asked to do turns out to be refused."""
    client = context.client

    async def wait():
        try:
            await asyncio.wrap_future(future)
        except ValueError as error:
            with client:
                complain(str(error))
    background_tasks.create(wait())


async def asked(question):
    """Return whether something asked of a node was done; say why not."""
    try:
        await question
    except NoAnswerError as error:
        complain(str(error))
        return False
    return True
