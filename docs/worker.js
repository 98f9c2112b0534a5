// Browsers start no workers for pages from the disk: there the search runs in a hidden frame.
if (location.protocol === "file:") {
  window.Worker = class {
    constructor(url) {
      this.frame = document.createElement("iframe");
      this.frame.hidden = true;
      this.frame.srcdoc = "<p>";
      this.ready = new Promise((done, failed) => {
        this.frame.onload = () => {
          const inner = this.frame.contentWindow;
          inner.postMessage = (data) => setTimeout(() => this.onmessage && this.onmessage({ data }));
          const script = inner.document.createElement("script");
          script.onload = () => done(inner);
          script.onerror = failed;
          script.src = new URL(url, location.href).href;
          inner.document.body.append(script);
        };
      });
      this.ready.catch((error) => this.onerror && this.onerror(error));
      document.body.append(this.frame);
    }
    postMessage(data) {
      this.ready.then((inner) => inner.dispatchEvent(new inner.MessageEvent("message", { data })));
    }
    terminate() {
      this.frame.remove();
    }
  };
}
