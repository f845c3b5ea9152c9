"""Eyeballs of the stage sink behind their lids, as those of the renderers do."""

from tests.running import RunningService
from tests.serving.studio.chromium import Browser
from tests.serving.studio.served import HARNESS

HALF_SHUT = {
    "eyeBlinkLeft": 0.8, "eyeBlinkRight": 0.9, "eyeLookInRight": 0.38, "eyeLookOutLeft": 0.38, "eyeLookUpLeft": 0.39,
    "eyeLookUpRight": 0.39, "eyeWideLeft": 0.79, "eyeWideRight": 0.79,
}  # fmt: skip
# Pixels that eyeballs change, in each pose, as they are and when they do not sink.
COUNT = """
    window.seen = window.failed = null;
    (async (poses) => {
      const { StageScene } = await import("tts2face-studio/stage_scene.js");
      const scene = new StageScene(document.createElement("canvas"), () => {});
      scene.resize(480, 480, 1);
      await scene.setFace("/studio/files/face.glb", new AbortController().signal);
      scene.view("close");
      const balls = scene.scene.children.filter((mesh) => mesh.material.defines?.EYE);
      const gl = scene.renderer.getContext(), n = 4 * gl.drawingBufferWidth * gl.drawingBufferHeight;
      const picture = (visible) => {
        for (const ball of balls) ball.visible = visible;
        scene.render();
        const pixels = new Uint8Array(n);
        gl.readPixels(0, 0, gl.drawingBufferWidth, gl.drawingBufferHeight, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
        return pixels;
      };
      const changed = () => {
        const [shown, hidden] = [picture(true), picture(false)];
        let count = 0;
        for (let i = 0; i < n; i += 4) count += Math.abs(shown[i + 1] - hidden[i + 1]) > 8;
        return count;
      };
      window.seen = poses.map((pose) => {
        scene.face.names.forEach((name, k) => (scene.weights[k] = pose[name] ?? 0));
        scene.pose();
        const sink = scene.shared.sink.value, kept = sink.clone(), sunk = changed();
        sink.set(0, 0);
        const still = changed();
        sink.copy(kept);
        return [sunk, still];
      });
      scene.dispose();
    })(arguments[0]).catch((error) => { window.failed = String(error.stack ?? error); })"""


def test_eyeballs_sink_behind_their_lids(browser: Browser, studio_service: RunningService) -> None:
    browser.open(studio_service.url + HARNESS)
    browser.wait("return window.did_handshake")
    browser.run(COUNT, [{}, HALF_SHUT])
    browser.wait("return window.seen || window.failed", seconds=120)
    assert browser.run("return window.failed") is None
    (opened, opened_flat), (lowered, lowered_flat) = browser.run("return window.seen")
    assert 0.97 * opened_flat < opened <= opened_flat  # open eyes are as they were
    assert lowered < 0.92 * lowered_flat < 0.5 * opened  # an iris was seen through the upper lid
