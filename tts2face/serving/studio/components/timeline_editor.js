// Forms in which the values of an element are typed.

import { clock } from "./clock.js";
import { DIRECTIONS, EDITS, GESTURES, KINDS } from "./protocol.js";
import { SPAN_ROWS } from "./timeline_values.js";
import { gestureLabel, rounded } from "./timeline_view.js";

const number = (name, label, value, low, high, step) => ({ name, label, value: rounded(value), low, high, step });

/** Open the form of an element; words and phones have none. */
export function openEditor(host, row, item) {
  const forms = { span: openSpan, gesture: openGesture, gaze: openElement, listen: openElement, key: openKey };
  clock.pause();
  forms[item.kind]?.(host, row, item);
}

function times(begin, end, duration) {
  return [
    number("start", "Start in seconds", begin, 0, rounded(duration), 0.01),
    number("end", "End in seconds", Math.min(end, duration), 0, rounded(duration), 0.01),
  ];
}

function openSpan(host, row, item) {
  const { view, styles } = host.state, { feature, style, start } = item.span, end = Math.min(item.end, view.duration);
  const fields = [{ name: "style", label: "Style", value: style, options: styles.map((one) => one.name) }, ...times(start, end, view.duration)];
  const apply = (values) => {
    if (values.end <= values.start) return host.component.say("The end must lie after the start.");
    if (values.start > start || values.end < end) host.emit(EDITS.erase({ feature, start, end }));
    return host.emit(EDITS.paint({ feature, ...values }));
  };
  host.component.openEditor(`Style on ${row.label}`, fields, apply, () => host.remove(row, item));
}

function openGesture(host, row, item) {
  const { time, name, size, seconds } = item.gesture;
  const fields = [
    { name: "name", label: "Gesture", value: name, options: Object.keys(GESTURES) },
    number("time", "Time in seconds", time, 0, host.state.view.duration, 0.01),
    number("size", "Size (1 is usual)", size, ...KINDS.gestures.limits, 0.1),
    number("seconds", "Duration in seconds (0 is usual)", seconds ?? 0, 0, 30, 0.1),
    { name: "direction", label: "Direction", value: directionOf(item.gesture), options: ["usual", ...Object.keys(DIRECTIONS)] },
  ];
  const apply = ({ direction, ...values }) => {
    const sides = GESTURES[values.name], [down, left] = DIRECTIONS[direction] ?? [null, null];
    if (down !== null && (sides === "none" || (sides === "side" && left === 0))) {
      return host.component.say(`The gesture ${gestureLabel(values.name)} has no direction ${direction}; choose usual.`);
    }
    const kept = direction === directionOf(item.gesture) ? item.gesture : { down_deg: down || null, left_deg: left || null };
    return host.replaceGesture(item.gesture, { ...values, seconds: values.seconds || null, down_deg: kept.down_deg ?? null, left_deg: kept.left_deg ?? null });
  };
  host.component.openEditor("Gesture", fields, apply, () => host.remove(row, item));
}

/** The nearest direction of the form. */
function directionOf({ down_deg: down, left_deg: left }) {
  if (!down && !left) return "usual";
  if (Math.abs(left ?? 0) >= Math.abs(down ?? 0)) return left > 0 ? "left" : "right";
  return down > 0 ? "down" : "up";
}

function openElement(host, row, item) {
  const { element } = item, { list, title } = SPAN_ROWS[row.id], { add, remove, limits } = KINDS[list];
  const fields = times(element.start, element.end, host.state.view.duration);
  if (list === "gaze") {
    fields.push(number("down_deg", "Degrees down", element.down_deg, ...limits, 1));
    fields.push(number("left_deg", "Degrees to the person’s left", element.left_deg, ...limits, 1));
  }
  const apply = (values) => {
    if (values.end <= values.start) return host.component.say("The end must lie after the start.");
    host.emit(EDITS[remove]({ time: element.start }));
    return host.emit(EDITS[add](values));
  };
  host.component.openEditor(title, fields, apply, () => host.remove(row, item));
}

function openKey(host, row, item) {
  const { state } = host, curve = state.model.curveOf(row, state.chosen), { low, high } = curve.limits;
  const what = row.id === "channel" ? "Offset" : "Value";
  const fields = [number("time", "Time in seconds", item.begin, 0, state.view.duration, 0.01), number("value", what, item.value, low, high, 0.01)];
  const apply = (values) => host.emit(state.model.moveKey(curve, item.number, values.time, values.value));
  host.component.openEditor("Key point", fields, apply, () => host.remove(row, item));
}
