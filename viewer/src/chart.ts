// One small chart over time: lines that are told apart by dashes and numbers as well as colour,
// and a cursor at the time of the page.

import { BAND_WORDS, bandOf, drawBand } from "./band";
import { noReturn, stroke, words } from "./marks";
import { bright, colour, legible } from "./palette";
import { roundStep } from "./round_step";

export interface Line {
  label: string;
  colour: string;
  /** One value per sample from t = 0. */
  values: number[];
  dash: number[];
  /** Whose it is; the others are pale while one UAS is looked at. */
  uas?: number;
  /** A thin line that goes with another one: no number, no dot, no name. */
  limit?: boolean;
}

/** A diamond on a line: at a sample and value, filled where it is serious, with words. */
export interface Point {
  sample: number;
  value: number;
  serious: boolean;
  colour: string;
  words: string;
}

export interface ChartContent {
  title: string;
  lines: Line[];
  dt: number;
  /** Format of a value at the cursor. */
  show: (value: number) => string;
  /** The range to be shown at least. */
  from?: number;
  to?: number;
  /** A level to be seen: [value, words]. */
  levels?: [number, string][];
  /** Samples to be marked on the first line. */
  marked?: number[];
  points?: Point[];
  /** Words in their colours, beside the title. */
  legend?: [string, string][];
  /** Values beyond the range are drawn at its edge. */
  clipped?: boolean;
  steps?: boolean;
}

export const LEFT = 40;
export const RIGHT = 18;
const TOP = 22;
const FEW = 4;
const MANY = 8;
const BOTTOM = 5;

export const DASHES = [[], [6, 3], [2, 3], [9, 3, 2, 3]];

/** A canvas over time with a cursor; clicks and drags on it set the time. */
export abstract class TimeCanvas {
  readonly canvas = document.createElement("canvas");
  protected readonly pen = this.canvas.getContext("2d")!;
  private readonly still = document.createElement("canvas");
  protected width = 0;
  protected height = 0;
  protected focused: number | null = null;

  constructor(
    private readonly title: string,
    private readonly duration: number,
    seek: (time: number) => void,
  ) {
    this.canvas.className = "chart";
    this.canvas.setAttribute("role", "img");
    this.canvas.setAttribute("aria-label", title);
    const seekTo = (event: PointerEvent) => {
      const across = (event.offsetX - LEFT) / (this.width - LEFT - RIGHT);
      seek(across * duration);
    };
    this.canvas.addEventListener("pointerdown", (event) => {
      this.canvas.setPointerCapture(event.pointerId);
      seekTo(event);
    });
    this.canvas.addEventListener("pointermove", (event) => {
      if (this.canvas.hasPointerCapture(event.pointerId)) seekTo(event);
    });
  }

  /** Draw what does not change with time. */
  resize(): void {
    this.width = this.canvas.clientWidth;
    this.height = this.canvas.clientHeight;
    const ratio = Math.min(devicePixelRatio, 2);
    for (const canvas of [this.canvas, this.still]) {
      canvas.width = Math.round(this.width * ratio);
      canvas.height = Math.round(this.height * ratio);
    }
    // a canvas of a page that is not laid out yet cannot be copied
    if (this.width === 0 || this.height === 0) return;
    this.pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    this.pen.clearRect(0, 0, this.width, this.height);
    this.drawStill();
    this.still.getContext("2d")!.drawImage(this.canvas, 0, 0);
  }

  /** Look at one UAS; null: at all. */
  focus(uas: number | null): void {
    if (uas === this.focused) return;
    this.focused = uas;
    if (this.width > 0) this.resize();
  }

  draw(time: number): void {
    if (this.width === 0 || this.height === 0) return;
    this.pen.clearRect(0, 0, this.width, this.height);
    this.pen.drawImage(this.still, 0, 0, this.width, this.height);
    const x = this.x(time);
    stroke(this.pen, x, TOP - 4, x, this.height - BOTTOM, 1.2, colour("--ink"));
    this.drawAt(time);
  }

  /** Say what is to be seen at a time, for readers that cannot see it. */
  describe(time: number): void {
    this.canvas.setAttribute("aria-label", `${this.title} at ${time.toFixed(1)} s: ${this.words(time)}`);
  }

  protected abstract drawStill(): void;
  protected abstract drawAt(time: number): void;
  /** Values at a time. */
  protected abstract words(time: number): string;

  protected x(time: number): number {
    return LEFT + (time / Math.max(this.duration, 1e-9)) * (this.width - LEFT - RIGHT);
  }

  protected write(
    text: string,
    x: number,
    y: number,
    ink: string,
    align: CanvasTextAlign = "left",
    weight = 400,
  ): number {
    const { pen } = this;
    pen.font = `${weight} 11px system-ui, sans-serif`;
    pen.textAlign = align;
    pen.textBaseline = "middle";
    pen.fillStyle = ink;
    pen.fillText(text, x, y);
    return pen.measureText(text).width;
  }
}

export class Chart extends TimeCanvas {
  private readonly low: number;
  private readonly high: number;
  private readonly step: number;

  private content: ChartContent;

  /** @param contentOf what is to be seen while one UAS, or none, is looked at */
  constructor(
    private readonly contentOf: (focused: number | null) => ChartContent,
    duration: number,
    seek: (t: number) => void,
  ) {
    const content = contentOf(null);
    super(content.title, duration, seek);
    this.content = content;
    const most = content.to ?? Infinity;
    const values = content.lines
      .flatMap((line) => line.values)
      .filter((value) => !content.clipped || value <= most);
    const low = values.reduce((a, b) => Math.min(a, b), content.from ?? Infinity);
    const high = values.reduce((a, b) => Math.max(a, b), content.to ?? -Infinity);
    const range = Number.isFinite(high - low) && high > low ? high - low : 1;
    this.step = roundStep(range / 1.6);
    this.low = Number.isFinite(low) ? low : 0;
    this.high = this.low + range;
  }

  protected drawStill(): void {
    const content = (this.content = this.contentOf(this.focused));
    const { pen } = this;
    const [left, right] = [LEFT, this.width - RIGHT];
    const together = content.lines.filter((line) => line.uas !== undefined && !line.limit);
    const many = together.length > MANY;
    this.write(`${content.title}${many ? ` (${BAND_WORDS})` : ""}`, 2, 9, colour("--ink"), "left", 600);
    let beside = right;
    for (const [word, hex] of [...(content.legend ?? [])].reverse()) {
      beside -= this.write(word, beside, 9, legible(hex), "right", 600) + 8;
    }
    pen.setLineDash([]);
    const first = Math.ceil(this.low / this.step - 1e-6);
    for (let n = first; n * this.step <= this.high * (1 + 1e-6); n++) {
      const y = this.y(n * this.step);
      stroke(pen, left, y, right, y, 1, colour("--grid"));
      const digits = Math.max(0, -Math.floor(Math.log10(this.step) + 1e-9));
      this.write((n * this.step).toFixed(digits), left - 5, y, colour("--faint"), "right");
    }
    for (const [level, words] of content.levels ?? []) {
      const y = this.y(level);
      pen.setLineDash([3, 3]);
      stroke(pen, left, y, right, y, 1, colour("--discharged"));
      pen.setLineDash([]);
      this.write(words, left + 4, y + 7, colour("--faint"));
    }
    if (many) this.band(together);
    for (const line of content.lines) {
      if (!many || line.uas === undefined || line.uas === this.focused) this.line(line);
    }
    this.names();
    for (const point of content.points ?? []) this.point(point);
    const marked = content.lines[0]?.values ?? [];
    for (const k of content.marked ?? []) {
      pen.fillStyle = colour("--discharged");
      pen.fillRect(this.x(k * content.dt) - 2, this.y(marked[k] ?? 0) - 2, 4, 4);
    }
  }

  protected drawAt(time: number): void {
    const { pen, content } = this;
    const shown: [number, string][] = [];
    for (const line of [...content.lines].reverse()) {
      if (line.limit || this.pale(line)) continue;
      const k = Math.min(line.values.length - 1, Math.floor(time / content.dt + 1e-6));
      if (k < 0) continue;
      pen.fillStyle = bright(line.colour);
      pen.beginPath();
      pen.arc(this.x(k * content.dt), this.y(line.values[k]), 3, 0, 2 * Math.PI);
      if (content.lines.length <= MANY || this.focused !== null) pen.fill();
      shown.push([line.values[k], legible(line.colour)]);
    }
    if (content.legend) return;
    let right = this.width - RIGHT;
    if (shown.length > FEW) {
      const [low, high] = [Math.min, Math.max].map((pick) => pick(...shown.map(([value]) => value)));
      const range = `${content.show(low)} to ${content.show(high)}`;
      this.write(range, right, 9, colour("--ink"), "right", 600);
      return;
    }
    for (const [value, ink] of shown) {
      right -= this.write(content.show(value), right, 9, ink, "right", 600) + 10;
    }
  }

  protected words(time: number): string {
    const { content } = this;
    const lines = content.lines.filter((line) => !line.limit && !this.pale(line));
    const value = (line: Line) =>
      line.values[Math.min(line.values.length - 1, Math.floor(time / content.dt + 1e-6))];
    if (lines.length > MANY) {
      const sorted = lines.map(value).sort((a, b) => a - b);
      const [least, median, greatest] = [0, 0.5, 1].map((rank) =>
        content.show(sorted[Math.round(rank * (sorted.length - 1))]),
      );
      return `least ${least}, median ${median}, greatest ${greatest} of ${lines.length}`;
    }
    const named = lines.map((line, n) => {
      const name = line.label || content.legend?.[n]?.[0] || "";
      return `${name} ${line.values.length > 0 ? content.show(value(line)) : "none"}`.trim();
    });
    const points = (content.points ?? []).map(
      (point) => `${point.words} at ${(point.sample * content.dt).toFixed(1)} s`,
    );
    return [...named, ...points].join(", ");
  }

  private pale(line: Line): boolean {
    return this.focused !== null && line.uas !== undefined && line.uas !== this.focused;
  }

  /** Of many lines their span; pale behind the one that is looked at. */
  private band(lines: Line[]): void {
    const { pen, content } = this;
    const band = bandOf(lines.map((line) => line.values));
    const x = (k: number) => this.x(k * content.dt);
    const ink = this.focused === null ? "--accent" : "--faint";
    drawBand(pen, band, colour(ink), x, (value) => this.y(value));
  }

  private point({ sample, value, serious, colour: hex, words }: Point): void {
    const [x, y] = [this.x(sample * this.content.dt), this.y(value)];
    noReturn(this.pen, x, y, 5, serious, hex);
    const left = x > this.width / 2;
    const ink = serious ? colour("--discharged") : legible(hex);
    const above = y - 12 > TOP ? y - 11 : y + 12;
    this.write(words, left ? x - 6 : x + 6, above, ink, left ? "right" : "left", 600);
  }

  private line(line: Line): void {
    const { pen, content } = this;
    pen.globalAlpha = this.pale(line) ? 0.2 : 1;
    pen.strokeStyle = bright(line.colour);
    pen.lineWidth = line.limit ? 1 : 1.6;
    pen.lineJoin = "round";
    pen.setLineDash(line.dash);
    pen.beginPath();
    line.values.forEach((value, k) => {
      const x = this.x(k * content.dt);
      if (content.steps && k > 0) pen.lineTo(x, this.y(line.values[k - 1]));
      pen.lineTo(x, this.y(value));
    });
    pen.stroke();
    pen.setLineDash([]);
    pen.globalAlpha = 1;
  }

  /** The number of each line where it ends, moved apart where two end together. */
  private names(): void {
    const { content } = this;
    // the names of many would cover each other, and the readings above
    const named = content.lines.filter((line) => !line.limit && !this.pale(line));
    if (named.length < 2 || 11 * named.length > this.height - TOP) return;
    const ends = named
      .filter((line) => line.values.length > 0 && line.label !== "")
      .map((line) => ({
        line,
        x: this.x((line.values.length - 1) * content.dt) + 3,
        y: this.y(line.values.at(-1)!),
      }))
      .sort((a, b) => a.y - b.y);
    ends.forEach((end, i) => {
      if (i > 0) end.y = Math.max(end.y, ends[i - 1].y + 11);
    });
    let room = this.height - BOTTOM - 4;
    for (const { line, x, y } of ends.reverse()) {
      const apart = Math.min(y, room);
      room = apart - 11;
      this.pen.font = "600 11px system-ui, sans-serif";
      // a long name that begins at the end of a flight would leave the picture; it lies on the curve
      const left = Math.min(x, this.width - 1 - this.pen.measureText(line.label).width);
      words(this.pen, line.label, left, apart, 11, legible(line.colour), "left");
    }
  }

  private y(value: number): number {
    const bottom = this.height - BOTTOM - 4;
    const shown = this.content.clipped ? Math.min(this.high, Math.max(this.low, value)) : value;
    return bottom - ((shown - this.low) / (this.high - this.low)) * (bottom - TOP - 2);
  }
}
