/* Search runs in a worker, and browsers start no worker from a file. Where a page is opened from the disk its script runs
   in a hidden frame instead. Pages that a server sends are left as they are. */
if (location.protocol === "file:") {
  window.Worker = class {
    constructor(url) {
      this.onmessage = this.onerror = this.onmessageerror = null;
      this.waiting = [];
      this.frame = document.createElement("iframe");
      this.frame.hidden = true;
      document.documentElement.append(this.frame);
      const inside = (this.inside = this.frame.contentWindow);
      // What the script posts goes to whoever made the worker.
      inside.postMessage = (data) => this.onmessage?.(new MessageEvent("message", { data }));
      const script = inside.document.createElement("script");
      script.src = new URL(url, location.href).href;
      script.onload = () => {
        const waiting = this.waiting;
        this.waiting = null;
        waiting.forEach((data) => this.deliver(data));
      };
      script.onerror = (event) => this.onerror?.(event);
      inside.document.documentElement.append(script);
    }
    deliver(data) {
      if (this.inside) this.inside.dispatchEvent(new this.inside.MessageEvent("message", { data }));
    }
    postMessage(data) {
      // A worker answers later, never while it is asked.
      if (this.waiting) this.waiting.push(data);
      else setTimeout(() => this.deliver(data));
    }
    terminate() {
      this.frame.remove();
      this.inside = null;
    }
  };
}
