// Camera and microphone of this computer.

const WANTED = {
  video: { width: { ideal: 640 }, height: { ideal: 480 }, frameRate: { ideal: 30 } },
  audio: { echoCancellation: false, noiseSuppression: false, autoGainControl: false },
};
const KINDS = ["video/webm;codecs=vp8,opus", "video/webm", "video/mp4"];
const BITS_PER_SECOND = 4e6;

/** Stream of both; an error whose message says what to do where the browser refuses. */
export async function openCamera() {
  if (!navigator.mediaDevices) {
    throw new Error("The browser gives the camera to pages of this computer or of https only; open the studio there.");
  }
  try {
    return await navigator.mediaDevices.getUserMedia(WANTED);
  } catch (refused) {
    const message = "The camera or the microphone cannot be used; allow both for this page, and close other programs that use them.";
    throw new Error(message, { cause: refused });
  }
}

/** A recorder of a stream; `take` gets the whole recording as a Blob when it has stopped. */
export function streamRecorder(stream, take) {
  const type = KINDS.find((one) => MediaRecorder.isTypeSupported(one)), parts = [];
  const recorder = new MediaRecorder(stream, { mimeType: type, videoBitsPerSecond: BITS_PER_SECOND });
  recorder.ondataavailable = (event) => parts.push(event.data);
  recorder.onstop = () => take(new Blob(parts, { type }));
  return recorder;
}
