// The flights that are looked at, one or two: panels and controls, drawn when something has changed.

import { Clock } from "./clock";
import { Controls, type Saved, type ViewChoice } from "./controls";
import { element } from "./dom";
import { Flight } from "./flight";
import type { FlightData } from "./flight_data";
import { Pace } from "./pace";
import { onThemeChange } from "./palette";
import { Panel } from "./panel";
import { Film, savePicture, saveTable, type Shown } from "./save";
import { Trail, TRAILS, type TrailKind } from "./trail";

export class Page {
  readonly data: FlightData[];
  private readonly flights: Flight[];
  private readonly clock: Clock;
  private readonly choice: ViewChoice = { threeD: true, followed: null, together: false };
  private readonly pace: Pace;
  private readonly film: Film;
  private readonly panels: Panel[];
  private readonly has3d: boolean;
  private readonly controls: Controls;
  private readonly main: HTMLElement;
  private readonly observer = new ResizeObserver(() => this.resize());
  private readonly ended = new AbortController();
  private trailKind: TrailKind = "uas";
  private dirty = true;
  private described = true;

  /**
   * @param data of one or two flights
   * @param open asks for files with other flights; null: nothing can be opened here
   * @param fromEnd begin at the end, unless the address names a moment
   */
  constructor(data: FlightData[], open: (() => void) | null, fromEnd = false) {
    this.data = data;
    this.flights = data.map((each) => new Flight(each));
    this.clock = new Clock(this.longest(), () => this.invalidate());
    this.film = new Film(this.clock, this.fileName());
    this.pace = new Pace((coarse) => {
      for (const panel of this.panels) panel.setCoarse(coarse);
      this.invalidate();
    });
    const { signal } = this.ended;
    this.panels = this.flights.map((flight) => this.panel(flight));
    this.has3d = this.panels.every((panel) => panel.has3d);
    const events = {
      show: (threeD: boolean) => this.show(threeD),
      follow: (uas: number | null) => this.follow(uas),
      overview: () => this.frame("overview"),
      top: () => this.frame("top"),
      trail: (kind: TrailKind) => this.colourTrails(kind),
      together: (on: boolean) => this.together(on),
      save: (what: Saved) => this.save(what),
      open,
      turn: (turn: number, tilt: number, nearer: number) => this.panels[0].turn(turn, tilt, nearer),
    };
    this.controls = new Controls(this.clock, this.flights, this.choice, this.has3d, events, signal);
    this.controls.sampleTime = Math.min(...data.map((each) => each.dt_s));
    this.main = element("main", { class: this.panels.length === 2 ? "two" : "one" });
    this.main.append(...this.panels.map((panel) => panel.element));
    document.body.append(this.main, this.controls.element);

    for (const panel of this.panels) {
      this.observer.observe(panel.stage);
      this.observer.observe(panel.curveBox);
    }
    onThemeChange(() => {
      for (const panel of this.panels) panel.repaint();
      this.invalidate();
    }, signal);
    addEventListener("hashchange", () => this.readAddress(), { signal });
    if (fromEnd) this.clock.seek(this.clock.duration);
    this.readAddress();
    requestAnimationFrame((now) => this.loop(now));
  }

  /** The flight that is still flown has gone on: a view of its end moves on with it. */
  renew(renewed: FlightData): void {
    const { clock } = this;
    const atEnd = !clock.playing && clock.time >= clock.duration - 1e-6;
    this.flights[0].renew(renewed);
    clock.duration = this.longest();
    this.controls.renew(this.flights);
    for (const panel of this.panels) panel.renew();
    if (this.trailKind !== "uas") this.colourTrails(this.trailKind);
    if (atEnd) clock.seek(clock.duration);
    this.invalidate();
  }

  /** Take all of it off the page. */
  end(): void {
    this.ended.abort();
    this.observer.disconnect();
    for (const panel of this.panels) panel.end();
    this.main.remove();
    this.controls.element.remove();
  }

  private panel(flight: Flight): Panel {
    return new Panel(flight, this.flights, {
      seek: (time) => {
        this.clock.playing = false;
        this.clock.seek(time);
      },
      follow: (uas) => this.follow(this.choice.followed === uas ? null : uas),
      invalidate: () => this.invalidate(),
      moved: (from, pose) => this.panels.forEach((each) => each !== from && each.take(pose)),
      lost: () => this.ended.signal.aborted || this.show(false),
    });
  }

  private longest(): number {
    return Math.max(...this.flights.map((flight) => flight.duration));
  }

  private invalidate(): void {
    this.dirty = true;
  }

  private show(threeD: boolean): void {
    this.choice.threeD = threeD && this.has3d;
    for (const panel of this.panels) panel.show(this.choice.threeD);
    this.resize();
  }

  private follow(uas: number | null): void {
    this.choice.followed = uas;
    this.invalidate();
  }

  private frame(how: "overview" | "top"): void {
    this.choice.followed = null;
    for (const panel of this.panels) panel[how]();
    this.invalidate();
  }

  /** The second flight as ghosts in the scene of the first, or beside it. */
  private together(on: boolean): void {
    this.choice.together = on;
    this.main.className = this.panels.length === 2 && !on ? "two" : "one";
    this.panels.forEach((panel, i) => {
      panel.element.hidden = on && i > 0;
      panel.together(on && i === 0);
    });
    this.resize();
  }

  private colourTrails(kind: TrailKind): void {
    this.trailKind = kind;
    const trail = new Trail(kind, this.flights);
    for (const panel of this.panels) panel.setTrail(trail);
    this.invalidate();
  }

  private seen(): Shown[] {
    return this.panels.filter((panel) => !panel.element.hidden).map((panel) => panel.shown);
  }

  private save(what: Saved): void {
    if (what === "table") saveTable(this.flights, this.fileName());
    else if (what === "film") this.film.start(this.seen());
    else savePicture(this.seen(), `${this.fileName()}-${Math.round(this.clock.time)}s`);
  }

  private fileName(): string {
    const names = this.data.map(({ scene, planner }) => `${scene.name}-${planner}`);
    return names.map((name) => name.replace(/[^\w.-]+/g, "-")).join("-");
  }

  private resize(): void {
    for (const panel of this.panels) if (!panel.element.hidden) panel.resize();
    this.invalidate();
  }

  /** "#t=60&follow=2&view=map&trail=power&together=1": a moment to link to. */
  private readAddress(): void {
    const wanted = new URLSearchParams(location.hash.slice(1));
    const number = (name: string) => Number(wanted.get(name) ?? NaN);
    if (number("t") >= 0) this.clock.seek(number("t"));
    if (number("follow") >= 1 && number("follow") <= this.flights[0].uas) {
      this.choice.followed = number("follow") - 1;
    }
    const trail = TRAILS.find(([kind]) => kind === wanted.get("trail"));
    if (trail) this.controls.showTrail(trail[0]);
    if (wanted.get("together") === "1" && this.panels[0].other) this.together(true);
    this.show(wanted.get("view") !== "map");
  }

  private loop(now: number): void {
    if (this.ended.signal.aborted) return;
    const { clock } = this;
    if (clock.playing) clock.tick(now);
    const drawn = this.dirty;
    if (drawn) {
      this.dirty = this.described = false;
      for (const panel of this.panels) {
        if (!panel.element.hidden) panel.draw(clock.time, this.choice.followed);
      }
      this.controls.draw();
      this.film.drawn(this.seen());
    } else if (!this.described && !clock.playing) {
      this.described = true;
      for (const panel of this.panels) panel.describe(clock.time);
    }
    this.pace.tick(now, drawn);
    requestAnimationFrame((next) => this.loop(next));
  }
}
