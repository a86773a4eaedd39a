"use strict";
/* What a page shows is kept in its address, behind the #: the section, and what differs from how the page opens. */

class Address {
  /* `forms`: the forms whose controls are kept. `show()` is called after they were set from the address. `zooms`, where
     there are any, has `get()` and `set(zooms)`: vertical ranges, [low, high] by name. */
  constructor(forms, show, zooms) {
    Object.assign(this, { forms, show, zooms });
    window.addEventListener("hashchange", () => this.follow());
  }

  static parse() {
    const [first, ...rest] = decodeURI(location.hash.slice(1)).split("&");
    return first.includes("=")
      ? { section: "", settings: new URLSearchParams([first, ...rest].join("&")) }
      : { section: first, settings: new URLSearchParams(rest.join("&")) };
  }

  static takes(control, value) {
    if (value === null) return false;
    return control.options ? [...control.options].some((option) => option.value === value) : Number.isFinite(Number(value));
  }

  get controls() {
    return this.forms.flatMap((form) => [...form.elements]).filter((control) => control.name && "value" in control && control.type !== "button");
  }

  /* A link within the page goes to a section and leaves the rest as it is; any other address is shown. */
  follow() {
    if (Address.parse().settings.size) this.read();
    else this.write();
  }

  /* Show what the address says. */
  read() {
    const { section, settings } = Address.parse();
    if (!settings.size) return;
    this.forms.forEach((form) => form.reset());
    for (const control of this.controls) {
      const { name, value } = control;
      if (control.type === "radio") control.checked = settings.get(name) === value || control.checked;
      else if (control.type === "checkbox") control.checked = control.checked ? !settings.getAll(`no-${name}`).includes(value) : settings.getAll(name).includes(value);
      else if (Address.takes(control, settings.get(name))) control.value = settings.get(name);
    }
    this.show();
    if (this.zooms) {
      const named = [...settings].filter(([name]) => name.startsWith("y-"));
      const ranges = named.map(([name, range]) => [name.slice(2), range.split("..").map(Number)]);
      this.zooms.set(Object.fromEntries(ranges.filter(([, [low, high]]) => low < high)));
    }
    document.getElementById(section)?.scrollIntoView({ behavior: "instant" });
  }

  /* Say in the address what is shown. */
  write() {
    const settings = new URLSearchParams();
    for (const control of this.controls) {
      const { name, value } = control;
      if (control.type === "radio") {
        if (control.checked && !control.defaultChecked) settings.set(name, value);
      } else if (control.type === "checkbox") {
        if (control.checked !== control.defaultChecked) settings.append(control.checked ? name : `no-${name}`, value);
      } else if (control.options) {
        if (!control.selectedOptions[0].defaultSelected) settings.set(name, value);
      } else if (value !== control.defaultValue) settings.set(name, value);
    }
    for (const [name, range] of Object.entries(this.zooms ? this.zooms.get() : {})) {
      settings.set(`y-${name}`, range.map((end) => Number(end.toPrecision(6))).join(".."));
    }
    const said = [Address.parse().section, settings.toString()].filter(Boolean).join("&");
    history.replaceState(null, "", said ? `#${said}` : location.href.split("#")[0]);
  }
}

/* The units of the text are those of the toolbar. */
function showUnits() {
  document.documentElement.dataset.units = document.getElementById("toolbar").elements.units.value;
}
