"""How an FMU carries a WebAssembly component: FMI-LS-WASM, working draft (github.com/modelica/fmi-ls-wasm)."""

FOLDER = "wasm32-wasip2"  # below binaries/, where a system's binary has its platform's
SUFFIX = ".wasm"
MANIFEST = "extra/org.modelica.fmi-ls-wasm/manifest.xml"
COMPONENT = b"\0asm\x0d\0\x01\0"  # what a component begins with, and a mere module does not
