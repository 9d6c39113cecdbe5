// Starts a page from what is packed in it.  Nothing is asked of any network.
(async () => {
  try {
    // Pages of a site share the library.
    const packed = await unpackPage((id) => document.getElementById(id)?.textContent ?? window.atwoodLibrary);
    packed.start(packed.payload, packed.createEngine, packed.model);
  } catch (error) {
    const notice = document.createElement("p");
    notice.className = "notice";
    notice.textContent = `The page could not start: ${error.message}`;
    document.body.prepend(notice);
    throw error;
  }
})();
