// The plots' cursor follows the replay, and a click on a plot moves the replay there. The replay is viser's client in a
// frame of this page: its slider says what time it is, and its field for the time takes another.
(() => {
  const frame = document.getElementById("replay-frame");
  const source = document.getElementById("replay-data");
  if (!frame || !source) return;
  const { start, plots } = JSON.parse(source.textContent);
  const groups = [...document.querySelectorAll(".plots")];

  const slider = () => frame.contentDocument?.querySelector("[role=slider]");

  function now() {
    const value = parseFloat(slider()?.getAttribute("aria-valuenow"));
    return Number.isFinite(value) ? start + value : null;
  }

  // While it plays, the field is written anew all the time, and what is put there may be lost: look, and try again.
  let wanted = null;
  function goTo(time, tries = 10) {
    const mine = (wanted = {});
    setTimeout(() => {
      const shown = now();
      if (wanted === mine && tries && shown !== null && Math.abs(shown - time) > 0.02) goTo(time, tries - 1);
    }, 150);
    const field = slider()?.closest(".mantine-Paper-root")?.querySelector("input");
    if (!field) return;
    const window_ = frame.contentWindow;
    const set = Object.getOwnPropertyDescriptor(window_.HTMLInputElement.prototype, "value").set;
    set.call(field, String(Math.max(0, time - start).toFixed(3)));
    field.dispatchEvent(new window_.Event("input", { bubbles: true }));
  }

  function nearest(times, time) {
    let low = 0, high = times.length - 1;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (times[middle] <= time) low = middle; else high = middle;
    }
    return time - times[low] < times[high] - time ? low : high;
  }

  function place(drawing, time) {
    const { left, right, first, last } = drawing.dataset;
    const share = (Math.min(Math.max(time, +first), +last) - first) / (last - first || 1);
    drawing.querySelector(".cursor").style.left = `${100 * (+left + share * (right - left))}%`;
  }

  function show(time) {
    groups.forEach((group, number) => {
      if (group.hidden) return;
      group.querySelectorAll(".plot").forEach((plot, index) => {
        place(plot.querySelector(".drawing"), time);
        const { time: times, values } = plots[number][index];
        const at = nearest(times, time);
        plot.querySelectorAll("output").forEach((output, curve) => {
          const value = values[curve][at];
          output.textContent = value === null ? "–" : String(+value.toPrecision(3));
        });
      });
    });
  }

  document.querySelectorAll(".drawing").forEach((drawing) => {
    const move = (event) => {
      const box = drawing.getBoundingClientRect();
      const { left, right, first, last } = drawing.dataset;
      const share = ((event.clientX - box.left) / box.width - left) / (right - left);
      goTo(+first + Math.min(Math.max(share, 0), 1) * (last - first));
    };
    drawing.addEventListener("pointerdown", (event) => {
      drawing.setPointerCapture(event.pointerId);
      move(event);
    });
    drawing.addEventListener("pointermove", (event) => { if (event.buttons) move(event); });
  });

  document.getElementById("replay-choice")?.addEventListener("change", (event) => {
    groups.forEach((group, number) => { group.hidden = String(number) !== event.target.value; });
    last = null;
  });

  let last = null;
  function follow() {
    const time = now();
    if (time !== null && time !== last) {
      show(time);
      last = time;
    }
    requestAnimationFrame(follow);
  }
  follow();
})();
