// Edits and elements of a timeline as the server has them, made of its tables by
// `python -m tts2face.serving.studio.protocol`: change those, and run it again.

export const FEATURES = ["expression", "brows", "blink", "cheeks", "gaze", "head"];
export const EXPRESSIONS = ["sad", "happy", "afraid", "angry", "surprised"];
export const HEAD_CHANNELS = ["pitch", "yaw", "roll", "x", "y", "z"];
export const GESTURES = {"nod": "none", "shake": "none", "tilt": "side", "look_away": "any", "look_at": "any", "wink": "side", "blink": "none", "brows_up": "none", "brows_together": "none", "smile": "none", "frown": "none", "laugh": "none", "sigh": "none", "surprise": "none", "think": "any", "listen": "none"};
export const DIRECTIONS = {"left": [0.0, 15.0], "right": [0.0, -15.0], "up": [-12.0, 0.0], "down": [12.0, 0.0]};
export const LEAST_PHONE_S = 0.01;

/** Elements: shape, field that names a lane, edits that add and remove one, limits of values. */
export const KINDS = {
  spans: { shape: "span", owner: "feature", add: "paint", remove: "erase" },
  expressions: { shape: "span", owner: "expression", add: null, remove: null },
  gaze: { shape: "span", owner: "", add: "gaze", remove: "remove_gaze", limits: [-35.0, 35.0] },
  listens: { shape: "span", owner: "", add: "listen", remove: "remove_listen" },
  gestures: { shape: "instant", owner: "name", add: "gesture", remove: "remove_gesture", limits: [0.1, 2.0] },
  strengths: { shape: "curve", owner: "feature", add: "strength", remove: null, limits: [0.0, 3.0] },
  curves: { shape: "curve", owner: "expression", add: "curve", remove: null, limits: [-0.5, 1.5] },
  edits: { shape: "curve", owner: "channel", add: "channel", remove: null, limits: [-1000.0, 1000.0] },
};

/** Edits of their fields. */
export const EDITS = {
  paint: ({ feature, style, start, end }) => ({ kind: "paint", feature, style, start, end }),
  erase: ({ feature, start, end }) => ({ kind: "erase", feature, start, end }),
  curve: ({ expression, keys }) => ({ kind: "curve", expression, keys }),
  strength: ({ feature, keys }) => ({ kind: "strength", feature, keys }),
  channel: ({ channel, keys }) => ({ kind: "channel", channel, keys }),
  gesture: ({ time, name, size, seconds, down_deg, left_deg }) => ({ kind: "gesture", time, name, size, seconds, down_deg, left_deg }),
  remove_gesture: ({ time, name }) => ({ kind: "remove_gesture", time, name }),
  gaze: ({ start, end, down_deg, left_deg }) => ({ kind: "gaze", start, end, down_deg, left_deg }),
  remove_gaze: ({ time }) => ({ kind: "remove_gaze", time }),
  listen: ({ start, end }) => ({ kind: "listen", start, end }),
  remove_listen: ({ time }) => ({ kind: "remove_listen", time }),
  mute: ({ feature, on }) => ({ kind: "mute", feature, on }),
  solo: ({ feature, on }) => ({ kind: "solo", feature, on }),
  seed: ({ feature, seed }) => ({ kind: "seed", feature, seed }),
  edge: ({ text, occurrence, index, time }) => ({ kind: "edge", text, occurrence, index, time }),
  reset_edges: ({ text, occurrence }) => ({ kind: "reset_edges", text, occurrence }),
  pronounce: ({ word, phones }) => ({ kind: "pronounce", word, phones }),
  exclude: ({ utterance, start, on }) => ({ kind: "exclude", utterance, start, on }),
  request: ({ options }) => ({ kind: "request", options }),
  models: ({ options }) => ({ kind: "models", options }),
  picture: ({ options }) => ({ kind: "picture", options }),
  name: ({ name }) => ({ kind: "name", name }),
};
