// Whether pictures come fast enough; where they do not, they are drawn with fewer pixels as long as
// something moves, picture after picture, and whole again when it stands.

const SLOW_MS = 55;
const STANDS_MS = 250;
const LATE = 3;

export class Pace {
  private before = 0;
  private late = 0;
  private moved = 0;
  private coarse = false;

  constructor(private readonly changed: (coarse: boolean) => void) {}

  /** @param drawn whether this was a new picture */
  tick(now: number, drawn: boolean): void {
    const passed = now - this.before;
    this.before = now;
    if (drawn) {
      this.moved = now;
      this.late = passed > SLOW_MS ? this.late + 1 : 0;
      if (this.late >= LATE) this.set(true);
    } else {
      this.late = 0;
      if (now - this.moved > STANDS_MS) this.set(false);
    }
  }

  private set(coarse: boolean): void {
    if (coarse === this.coarse) return;
    this.coarse = coarse;
    this.changed(coarse);
  }
}
