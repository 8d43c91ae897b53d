// Out of the page: a picture, a table, a film.

import type { Clock } from "./clock";
import type { Flight } from "./flight";
import { colour } from "./palette";
import { table } from "./table";

const TITLE_PX = 26;
const FILM_FPS = 30;
const LAST_MS = 800;
const FILMS = ["video/webm;codecs=vp9", "video/webm", "video/mp4"];

/** A flight's name and the canvases that show it, the lowest first. */
export interface Shown {
  title: string;
  canvases: HTMLCanvasElement[];
}

/** What is seen of the flights, side by side, drawn on a canvas. */
export function compose(shown: Shown[], on = document.createElement("canvas")): HTMLCanvasElement {
  const ratio = Math.min(devicePixelRatio, 2);
  const sizes = shown.map(({ canvases: [canvas] }) => [canvas.clientWidth, canvas.clientHeight]);
  const width = sizes.reduce((sum, [each]) => sum + each, 0);
  const height = TITLE_PX + Math.max(...sizes.map(([, each]) => each));
  const wanted = [Math.round(width * ratio), Math.round(height * ratio)];
  if (on.width !== wanted[0] || on.height !== wanted[1]) [on.width, on.height] = wanted;
  const pen = on.getContext("2d")!;
  pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  pen.fillStyle = colour("--paper");
  pen.fillRect(0, 0, width, height);
  let left = 0;
  shown.forEach(({ title, canvases }, n) => {
    const [across, down] = sizes[n];
    for (const canvas of canvases) pen.drawImage(canvas, left, TITLE_PX, across, down);
    pen.font = "600 13px system-ui, sans-serif";
    pen.textBaseline = "middle";
    pen.fillStyle = colour("--ink");
    pen.fillText(title, left + 10, TITLE_PX / 2, across - 20);
    left += across;
  });
  return on;
}

export function savePicture(shown: Shown[], name: string): void {
  compose(shown).toBlob((blob) => blob && save(blob, `${name}.png`), "image/png");
}

export function saveTable(flights: Flight[], name: string): void {
  save(new Blob([table(flights)], { type: "text/csv" }), `${name}.csv`);
}

/** The kind of film that this browser can record; null: none. */
export function filmKind(): string | null {
  if (typeof MediaRecorder === "undefined" || !HTMLCanvasElement.prototype.captureStream) return null;
  return FILMS.find((kind) => MediaRecorder.isTypeSupported(kind)) ?? null;
}

/** Plays on from here to the end, or until it is paused, and records what is seen. */
export class Film {
  private readonly canvas = document.createElement("canvas");
  private recorder: MediaRecorder | null = null;
  /** Until it records, and while the last picture stands. */
  private waits = false;

  constructor(private readonly clock: Clock, private readonly name: string) {}

  start(shown: Shown[]): void {
    const kind = filmKind();
    if (!kind || this.recorder) return;
    compose(shown, this.canvas);
    const recorder = new MediaRecorder(this.canvas.captureStream(FILM_FPS), { mimeType: kind });
    const parts: Blob[] = [];
    recorder.addEventListener("dataavailable", ({ data }) => parts.push(data));
    recorder.addEventListener("stop", () => {
      const type = kind.split(";")[0];
      save(new Blob(parts, { type }), `${this.name}.${type.split("/")[1]}`);
    });
    // what plays before it records would be missing
    recorder.addEventListener("start", () => {
      this.waits = false;
      if (!this.clock.playing) this.clock.toggle();
    });
    this.waits = true;
    this.recorder = recorder;
    recorder.start();
  }

  /** A picture has been drawn. */
  drawn(shown: Shown[]): void {
    const { recorder } = this;
    if (!recorder || this.waits) return;
    compose(shown, this.canvas);
    if (this.clock.playing) return;
    // the last picture stands for a moment; the recorder takes one only where something is drawn
    this.waits = true;
    const again = setInterval(() => compose(shown, this.canvas), LAST_MS / 4);
    setTimeout(() => {
      clearInterval(again);
      recorder.stop();
      this.recorder = null;
      this.waits = false;
    }, LAST_MS);
  }
}

function save(blob: Blob, name: string): void {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}
