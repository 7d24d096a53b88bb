# SPDX-License-Identifier: Apache-2.0
"""What the page does in the browser itself: pointers over the world, and keys while steering."""

# Of the pointer, as fractions of the picture from its upper left corner. The picture keeps the
# pointer until it is released. A second finger scrolls the page, and ends the stroke.
POINTER_EVENTS = ('pointerdown', 'pointermove', 'pointerup', 'pointercancel')
POINTER = """(event) => {
  const box = event.currentTarget.getBoundingClientRect();
  if (event.type === 'pointermove' && !(event.buttons & 1)) return;
  if (event.type === 'pointerdown' && event.isPrimary) {
    if (event.button !== 0) return;
    event.target.setPointerCapture(event.pointerId);
  }
  emit({type: event.isPrimary ? event.type : 'pointercancel',
        touch: event.pointerType === 'touch',
        x: (event.clientX - box.left) / box.width, y: (event.clientY - box.top) / box.height});
}"""

# While somebody steers, the arrow keys steer and nothing else: they neither scroll nor move the
# slider that was used last. The space bar does not scroll. Fields of text keep their keys.
STEERING = 'data-steering'  # attribute of the element that tells whether this page steers
STEERING_KEYS = """<script>
for (const type of ['keydown', 'keyup']) window.addEventListener(type, (event) => {
  const steers = document.querySelector('[data-steering=true]');
  if (!steers || !event.isTrusted || event.ctrlKey || event.altKey || event.metaKey ||
      event.target.closest?.('input:not([type=checkbox]), select, textarea')) return;
  if (event.key.startsWith('Arrow')) {
    event.preventDefault();
    event.stopImmediatePropagation();
    document.dispatchEvent(new KeyboardEvent(type, {
      key: event.key, code: event.code, repeat: event.repeat}));
  } else if (event.key === ' ' && event.target === document.body) {
    event.preventDefault();
  }
}, true);
window.addEventListener('click', (event) => {  // the switch takes the focus after the click
  if (event.detail && event.target.closest?.('.steering-switch'))
    setTimeout(() => document.activeElement.blur());
}, true);
</script>"""
