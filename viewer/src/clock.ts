// Time of the page: stands, runs at a multiple of real time, or is set by hand.

export const SPEEDS = [1, 2, 5, 10, 20, 50];

export class Clock {
  time = 0;
  speed = 10;
  playing = false;
  private before = 0;

  constructor(
    /** May grow, while a flight is still flown. */
    public duration: number,
    private readonly changed: () => void,
  ) {}

  seek(time: number): void {
    this.time = Math.min(Math.max(time, 0), this.duration);
    this.changed();
  }

  /** Play from here, or from the start where the end was reached; or stand still. */
  toggle(): void {
    this.playing = !this.playing;
    if (this.playing && this.time >= this.duration) this.time = 0;
    this.before = performance.now();
    this.changed();
  }

  pause(): void {
    this.playing = false;
    this.changed();
  }

  faster(by: number): void {
    const i = SPEEDS.indexOf(this.speed) + by;
    this.speed = SPEEDS[Math.min(Math.max(i, 0), SPEEDS.length - 1)];
    this.changed();
  }

  /** Move on by the real time since the last call. */
  tick(now: number): void {
    const passed = Math.max(0, now - this.before) / 1000;
    this.before = now;
    // a page that slept in the background goes on where it was
    this.time += Math.min(passed, 0.5) * this.speed;
    if (this.time >= this.duration) {
      this.time = this.duration;
      this.playing = false;
    }
    this.changed();
  }
}
