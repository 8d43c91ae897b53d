// What each UAS was doing when: a band per UAS, with words where there is room for them.

import { RIGHT, TimeCanvas } from "./chart";
import type { Flight } from "./flight";
import { shortName } from "./marks";
import { colour, legible } from "./palette";

const TOP = 20;
/** Height of a row of charts, of which a chart of many takes several. */
const ROW_PX = 94;
const WORDS_PX = 11;
const MANY = 8;

/** [custom property of the style, colour of words on it] */
const PAINT: Record<string, [string, string]> = {
  covering: ["--covering", "#ffffff"],
  transit: ["--transit", "#1b1b1b"],
  return: ["--returning", "#1b1b1b"],
  landed: ["--landed", "#1b1b1b"],
  lost: ["--discharged", "#ffffff"],
};

export class ModeChart extends TimeCanvas {
  constructor(private readonly flight: Flight, duration: number, seek: (time: number) => void) {
    super("Operation modes", duration, seek);
    const rows = flight.uas > MANY ? 4 : flight.uas;
    const high = TOP + 8 + rows * (rows > 6 ? 8 : 15);
    this.canvas.style.gridRow = `span ${Math.ceil(high / ROW_PX)}`;
  }

  protected drawStill(): void {
    this.write("Operation mode", 2, 9, colour("--ink"), "left", 600);
    let right = this.width - RIGHT;
    const used = new Set(this.flight.data.mode_runs.flat().map(([mode]) => mode));
    for (const [m, mode] of [...this.flight.data.modes.entries()].reverse()) {
      if (!used.has(m)) continue;
      right -= this.write(mode, right, 9, colour("--faint"), "right") + 14;
      this.pen.fillStyle = colour(PAINT[mode][0]);
      this.pen.fillRect(right, 4, 10, 10);
      right -= 10;
    }
    if (this.flight.uas > MANY) {
      this.shares();
      return;
    }
    const height = Math.min(26, (this.height - TOP - 6) / this.flight.uas);
    this.flight.scene.uas.forEach((uas, i) => {
      const y = TOP + i * height;
      // of rows that are low every second has room for its number
      if (height >= WORDS_PX || i % 2 === 0) {
        this.write(shortName(uas.name), 35, y + height / 2, legible(uas.colour), "right", 600);
      }
      const gap = height >= WORDS_PX ? 3 : 1;
      this.bands(i, y, height - gap);
    });
  }

  protected drawAt(): void {}

  /** Of many how many do what, over time; above them the one that is looked at. */
  private shares(): void {
    const { modes, samples, dt_s } = this.flight.data;
    const own = this.focused === null ? 0 : 16;
    if (this.focused !== null) {
      const { name, colour: hex } = this.flight.scene.uas[this.focused];
      this.write(shortName(name), 35, TOP + 6, legible(hex), "right", 600);
      this.bands(this.focused, TOP, 13);
    }
    const [top, bottom] = [TOP + own, this.height - 6];
    const unit = (bottom - top) / this.flight.uas;
    this.write(String(this.flight.uas), 35, top + 5, colour("--faint"), "right");
    this.write("0", 35, bottom - 4, colour("--faint"), "right");
    for (let k = 0; k < samples - 1; k++) {
      // whole pixels, or seams would be seen
      const [x, end] = [k, k + 1].map((each) => Math.round(this.x(each * dt_s)));
      let y = bottom;
      const counts = this.counts(k);
      for (const mode of modes) {
        const high = unit * (counts.get(mode) ?? 0);
        this.pen.fillStyle = colour((PAINT[mode] ?? ["--landed"])[0]);
        this.pen.fillRect(x, y - high, end - x, high);
        y -= high;
      }
    }
  }

  /** How many are in each mode at a sample. */
  private counts(k: number): Map<string, number> {
    const counts = new Map<string, number>();
    for (let i = 0; i < this.flight.uas; i++) {
      const mode = this.flight.mode(k, i);
      counts.set(mode, (counts.get(mode) ?? 0) + 1);
    }
    return counts;
  }

  protected words(time: number): string {
    const k = this.flight.moment(time).sample;
    const { modes } = this.flight.data;
    if (this.flight.uas > MANY) {
      const counts = this.counts(k);
      return modes
        .filter((mode) => counts.has(mode))
        .map((mode) => `${counts.get(mode)} ${mode}`)
        .join(", ");
    }
    return this.flight.scene.uas.map(({ name }, i) => `${name} ${this.flight.mode(k, i)}`).join(", ");
  }

  /** What one UAS was doing, from left to right. */
  private bands(i: number, y: number, height: number): void {
    const { modes, mode_runs: runs } = this.flight.data;
    for (const [mode, from, to] of runs[i]) this.band(modes[mode], from, to, y, height);
  }

  private band(mode: string, from: number, to: number, y: number, height: number): void {
    const { pen } = this;
    const { dt_s } = this.flight.data;
    const [x, end] = [this.x(from * dt_s), this.x(to * dt_s)];
    const [paint, ink] = PAINT[mode] ?? ["--landed", "#1b1b1b"];
    pen.fillStyle = colour(paint);
    pen.fillRect(x, y, Math.max(1.5, end - x - 1), height);
    pen.font = "400 11px system-ui, sans-serif";
    if (height >= WORDS_PX + 1 && pen.measureText(mode).width + 8 < end - x) this.write(mode, x + 4, y + height / 2, ink);
  }
}
