// The bar at the foot of the page: play, time, speed, and how the flight is looked at; and keys.

import { type Clock, SPEEDS } from "./clock";
import { element } from "./dom";
import type { Flight } from "./flight";
import { kindOf, timed } from "./panel";
import { filmKind } from "./save";
import { TRAILS, type TrailKind } from "./trail";

export interface ViewChoice {
  threeD: boolean;
  /** Two flights in one scene. */
  together: boolean;
  followed: number | null;
}

export interface ControlEvents {
  show(threeD: boolean): void;
  follow(uas: number | null): void;
  overview(): void;
  top(): void;
  trail(kind: TrailKind): void;
  together(on: boolean): void;
  save(what: Saved): void;
  /** Ask for other flights; null: none can be opened. */
  open: (() => void) | null;
  /** Turn and tilt the camera [rad], and come nearer by a factor. */
  turn(turn: number, tilt: number, nearer: number): void;
}

export type Saved = "picture" | "table" | "film";

const TURN_RAD = Math.PI / 18;
const NEARER = 1.2;

const KEYS: [string, string][] = [
  ["Space", "play, pause"],
  ["← →", "one step back, on (with Shift ten)"],
  ["Home End", "start, end"],
  ["+ −", "faster, slower"],
  ["1 … 9", "follow a UAS"],
  ["O", "whole area"],
  ["T", "from above"],
  ["M", "map or 3D"],
  ["A D W S", "turn and tilt the camera"],
  ["E Q", "nearer, farther"],
  ["C", "colour of the paths flown"],
  ["G", "two flights in one scene, or side by side"],
  ["?", "this list"],
];

export class Controls {
  readonly element: HTMLElement;
  private readonly play = button("", "Play or pause (space)");
  private readonly slider = element("input", {
    type: "range",
    min: "0",
    step: "any",
    "aria-label": "Time",
  });
  private readonly clockText = element("output", { class: "time" });
  private readonly speed = element("select", { "aria-label": "Speed", title: "Speed (+ −)" });
  private readonly kind = button("", "Map or 3D (M)");
  private readonly top: HTMLButtonElement;
  private readonly both = button("", "Both flights in one scene, or side by side (G)");
  private readonly followed = element("select", { "aria-label": "Follow", title: "Follow (1 … 9)" });
  private readonly trails = element("select", { "aria-label": "Trails", title: "Colour of the paths flown (C)" });
  private readonly saved = element("select", { "aria-label": "Save", title: "Save a picture, a table, a film" });
  private readonly marks = element("div", { class: "happened" });
  private readonly help = helpDialog();
  private readonly ghosts: boolean;

  constructor(
    private readonly clock: Clock,
    flights: Flight[],
    private readonly choice: ViewChoice,
    private readonly has3d: boolean,
    private readonly events: ControlEvents,
    signal: AbortSignal,
  ) {
    this.speed.append(...SPEEDS.map((n) => element("option", { value: String(n) }, `${n}×`)));
    const names = flights.reduce((a, b) => (a.uas >= b.uas ? a : b)).scene.uas;
    this.followed.append(
      element("option", { value: "" }, "Follow"),
      ...names.map(({ name }, i) => element("option", { value: String(i) }, `Follow ${name}`)),
    );
    this.trails.append(
      ...TRAILS.map(([kind, words]) => element("option", { value: kind }, `Trails ${words}`)),
    );
    this.saved.append(
      element("option", { value: "" }, "Save"),
      element("option", { value: "picture" }, "Picture (PNG)"),
      element("option", { value: "table" }, "Table (CSV)"),
      ...(filmKind() ? [element("option", { value: "film" }, "Film, from here on")] : []),
    );
    this.saved.addEventListener("change", () => {
      const what = this.saved.value as Saved;
      this.saved.value = "";
      this.saved.blur();
      events.save(what);
    });
    const overview = button("Overview", "Whole area (O)");
    this.top = button("Top", "From above (T)");
    const opener = button("Open", "Another flight beside this one: its replay.html (or drop it here)");
    opener.hidden = events.open === null;
    opener.addEventListener("click", () => events.open?.());
    const question = button("?", "Keys (?)");
    question.className = "keys";
    this.element = element(
      "footer",
      { class: "controls" },
      element("div", { class: "row" }, this.play, element("div", { class: "track" }, this.slider, this.marks), this.clockText, this.speed),
      element("div", { class: "row views" }, this.kind, this.both, overview, this.top, this.followed, this.trails, this.saved, opener, question),
      this.help,
    );
    this.renew(flights);
    this.kind.hidden = !has3d;
    this.ghosts = flights.length === 2 && flights[0].sameMission(flights[1]);
    this.both.hidden = !this.ghosts;
    this.both.addEventListener("click", () => events.together(!choice.together));
    this.play.addEventListener("click", () => clock.toggle());
    this.slider.addEventListener("input", () => {
      clock.playing = false;
      clock.seek(Number(this.slider.value));
    });
    this.speed.addEventListener("change", () => {
      clock.speed = Number(this.speed.value);
      this.draw();
    });
    this.followed.addEventListener("change", () => {
      const { value } = this.followed;
      events.follow(value === "" ? null : Number(value));
    });
    this.trails.addEventListener("change", () => events.trail(this.trails.value as TrailKind));
    this.kind.addEventListener("click", () => events.show(!choice.threeD));
    overview.addEventListener("click", () => events.overview());
    this.top.addEventListener("click", () => events.top());
    question.addEventListener("click", () => this.toggleHelp());
    // a button that was clicked must not catch the next space
    this.element.addEventListener("click", (event) => {
      const target = event.target as HTMLElement;
      if (event.detail > 0 && target instanceof HTMLButtonElement) target.blur();
    });
    addEventListener("keydown", (event) => this.key(event), { signal });
  }

  draw(): void {
    const { clock } = this;
    this.play.textContent = clock.playing ? "❚❚" : "▶";
    this.play.setAttribute("aria-label", clock.playing ? "Pause" : "Play");
    this.slider.value = String(clock.time);
    const time = `${clock.time.toFixed(1)} s`;
    this.slider.setAttribute("aria-valuetext", time);
    this.slider.style.setProperty("--done", `${(100 * clock.time) / (clock.duration || 1)}%`);
    this.clockText.value = `${time} / ${clock.duration.toFixed(0)} s`;
    this.speed.value = String(clock.speed);
    this.top.hidden = !this.choice.threeD;
    this.kind.textContent = this.choice.threeD ? "Map" : "3D";
    this.both.textContent = this.choice.together ? "Apart" : "Together";
    this.followed.value = this.choice.followed === null ? "" : String(this.choice.followed);
  }

  /** A mark over the slider at all that happened: a click leads there. */
  renew(flights: Flight[]): void {
    this.slider.max = String(this.clock.duration);
    const share = (time: number) => `${100 * Math.min(1, time / (this.clock.duration || 1))}%`;
    const all = flights.flatMap((flight) => flight.marks()).map((happened) => {
      const { t_s, until_s, kind } = happened;
      const mark = element("i", { class: kindOf(kind), role: "button", title: timed(happened) });
      mark.setAttribute("aria-label", timed(happened));
      mark.style.left = share(t_s);
      mark.style.width = `max(4px, ${share(until_s - t_s)})`;
      mark.addEventListener("click", () => {
        this.clock.playing = false;
        this.clock.seek(t_s);
      });
      return mark;
    });
    this.marks.replaceChildren(...all);
  }

  showTrail(kind: TrailKind): void {
    this.trails.value = kind;
    this.events.trail(kind);
  }

  private nextTrail(): void {
    this.trails.selectedIndex = (this.trails.selectedIndex + 1) % TRAILS.length;
    this.events.trail(this.trails.value as TrailKind);
  }

  private toggleHelp(): void {
    if (this.help.open) this.help.close();
    else this.help.showModal();
  }

  private key(event: KeyboardEvent): void {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const target = event.target as HTMLElement;
    // lists and buttons have keys of their own
    if (target instanceof HTMLSelectElement) return;
    if (target instanceof HTMLInputElement && target.type === "search") return;
    if (target instanceof HTMLButtonElement && [" ", "Enter"].includes(event.key)) return;
    if (this.help.open && event.key !== "?") return;
    const action = this.action(event);
    if (!action) return;
    event.preventDefault();
    action();
  }

  private action(event: KeyboardEvent): (() => void) | undefined {
    const { clock, events, choice } = this;
    const move = (samples: number) => () => this.step(event.shiftKey ? 10 * samples : samples);
    if (/^[1-9]$/.test(event.key)) {
      const uas = Number(event.key) - 1;
      const known = uas < this.followed.options.length - 1;
      return known ? () => events.follow(choice.followed === uas ? null : uas) : undefined;
    }
    const actions: Record<string, () => void> = {
      " ": () => clock.toggle(),
      ArrowRight: move(1),
      ArrowLeft: move(-1),
      Home: () => clock.seek(0),
      End: () => clock.seek(clock.duration),
      "+": () => clock.faster(1),
      "=": () => clock.faster(1),
      "-": () => clock.faster(-1),
      a: () => events.turn(TURN_RAD, 0, 1),
      d: () => events.turn(-TURN_RAD, 0, 1),
      w: () => events.turn(0, -TURN_RAD, 1),
      s: () => events.turn(0, TURN_RAD, 1),
      e: () => events.turn(0, 0, NEARER),
      q: () => events.turn(0, 0, 1 / NEARER),
      o: () => events.overview(),
      t: () => events.top(),
      c: () => this.nextTrail(),
      g: () => this.ghosts && events.together(!choice.together),
      m: () => this.has3d && events.show(!choice.threeD),
      "?": () => this.toggleHelp(),
    };
    return actions[event.key.length === 1 ? event.key.toLowerCase() : event.key];
  }

  /** To the next whole samples before or after. */
  private step(samples: number): void {
    const { clock } = this;
    clock.playing = false;
    const at = clock.time / this.sampleTime;
    const from = samples > 0 ? Math.floor(at + 1e-6) : Math.ceil(at - 1e-6);
    clock.seek((from + samples) * this.sampleTime);
  }

  /** Time between samples [s]; the shorter one of two flights. */
  sampleTime = 1;
}

function button(text: string, title: string): HTMLButtonElement {
  return element("button", { type: "button", title }, text);
}

function helpDialog(): HTMLDialogElement {
  const rows = KEYS.flatMap(([key, does]) => [
    element("dt", {}, element("kbd", {}, key)),
    element("dd", {}, does),
  ]);
  const close = element("form", { method: "dialog" }, element("button", {}, "Close"));
  return element(
    "dialog",
    { "aria-label": "Keys" },
    element("dl", {}, ...rows),
    element(
      "p",
      {},
      "A ring is a waypoint, a double ring one that counts more; it is filled and ticked once " +
        "covered. The ring around a UAS is as long as its charge, its notch is what the way home " +
        "takes with margin: green while more than 5 % is left beyond that, red where it is too " +
        "little. A diamond is where least was left, a red one the point of no return. Dots are " +
        "where the planner means to fly. A dashed line surrounds where the UAS of its colour can " +
        "still fly and come home from. A click on a waypoint or a path says what it was.",
    ),
    element("p", {}, "Drag to turn, wheel or two fingers to come closer, right button to move."),
    close,
  );
}
