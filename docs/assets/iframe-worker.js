/* Search in pages that are opened from disk. The theme runs its search in a Worker, and browsers start none for file: addresses. This
   class offers the part of a Worker that the search uses, with a hidden frame in place of a thread. */
if (location.protocol === "file:") {
  window.Worker = class extends EventTarget {
    constructor(script) {
      super()
      this.frame = document.createElement("iframe")
      this.frame.hidden = true
      document.body.append(this.frame)
      const inside = this.frame.contentWindow
      inside.postMessage = data => this.dispatchEvent(new MessageEvent("message", { data }))
      inside.importScripts = (...addresses) =>
        addresses.reduce((before, address) => before.then(() => this.run(address)), Promise.resolve())
      this.ready = this.run(script)
    }

    run(address) {
      const document = this.frame.contentWindow.document
      return new Promise((resolve, reject) => {
        const element = document.createElement("script")
        element.src = new URL(address, location.href)
        element.onload = resolve
        element.onerror = () => reject(new Error(`cannot load ${address}`))
        document.body.append(element)
      })
    }

    postMessage(data) {
      this.ready.then(() => this.frame.contentWindow.dispatchEvent(new MessageEvent("message", { data })))
    }

    terminate() {
      this.frame.remove()
    }
  }
}
