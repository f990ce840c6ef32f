# SPDX-License-Identifier: GPL-3.0-or-later
"""The zip, as somebody gets it: installed into a clean Blender, with nothing of the build in reach.

    python3 tests/packaging/test_addon_zip.py

BLENDER names the Blender to use, EXEMPLAR_BUILD the build folder; by default the one on the PATH
and the one that was configured last. EXEMPLAR_ZIP names a zip that was made elsewhere.
"""

import hashlib
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
import zipfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "python"))
import support  # noqa: E402

ROOT = Path(__file__).resolve().parents[2]
HERE = Path(__file__).resolve().parent
BLENDER = os.environ.get("BLENDER", "blender")


def build_folder():
    named = os.environ.get("EXEMPLAR_BUILD")
    if named:
        return Path(named).resolve()
    caches = [*ROOT.glob("build/CMakeCache.txt"), *ROOT.glob("build/*/CMakeCache.txt")]
    plain = [cache for cache in caches if "EXM_SANITIZE:BOOL=ON" not in cache.read_text()]
    if not plain:
        sys.exit("No build folder: configure one first, or set EXEMPLAR_BUILD")
    return max(plain, key=lambda cache: cache.stat().st_mtime).parent


def run(*command, **options):
    return subprocess.run(
        [str(word) for word in command], capture_output=True, text=True, timeout=600, **options
    )


def make_zip(build):
    if os.environ.get("EXEMPLAR_ZIP"):
        return Path(os.environ["EXEMPLAR_ZIP"])
    done = run("cmake", "--build", build, "--target", "addon_zip")
    if done.returncode:
        sys.exit(done.stdout + done.stderr)
    return max(build.glob("exemplar-*.zip"), key=lambda path: path.stat().st_mtime)


class Zip(unittest.TestCase):
    """What is in it."""

    @classmethod
    def setUpClass(cls):
        cls.build = build_folder()
        cls.path = make_zip(cls.build)
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = Path(folder.name)
        with zipfile.ZipFile(cls.path) as archive:
            cls.entries = archive.infolist()
            archive.extractall(cls.folder)
        cls.addon = cls.folder / "exemplar"
        cls.libraries = sorted((cls.addon / "native" / "lib").iterdir())

    def test_the_same_bytes_each_time(self):
        first = hashlib.sha256(self.path.read_bytes()).hexdigest()
        second = hashlib.sha256(make_zip(self.build).read_bytes()).hexdigest()
        self.assertEqual(first, second)

    def test_one_folder_in_order_without_dates_and_strays(self):
        names = [entry.filename for entry in self.entries]
        self.assertEqual(names, sorted(names))
        self.assertEqual({name.split("/")[0] for name in names}, {"exemplar"})
        self.assertEqual({entry.date_time for entry in self.entries}, {(1980, 1, 1, 0, 0, 0)})
        self.assertFalse([name for name in names if "__pycache__" in name or "/." in name])
        for name in ("__init__.py", "blender_manifest.toml", "command_line.py", "LICENSE"):
            self.assertIn(f"exemplar/{name}", names)

    def test_one_version_everywhere(self):
        cmake = (ROOT / "CMakeLists.txt").read_text()
        version = re.search(r"project\(Exemplar VERSION ([0-9.]+)", cmake)[1]
        manifest = (self.addon / "blender_manifest.toml").read_text()
        self.assertIn(f'version = "{version}"', manifest)
        info = (self.addon / "__init__.py").read_text()
        self.assertIn(f'"version": ({version.replace(".", ", ")})', info)
        self.assertIn(f"exemplar-{version}-", self.path.name)
        self.assertRegex(manifest, r'(?m)^platforms = \["linux-(x64|arm64)"\]$')

    def test_libraries_look_beside_themselves_and_find_all(self):
        present = {library.name for library in self.libraries}
        self.assertIn("libexemplar.so", present)
        for library in self.libraries:
            text = run("readelf", "--dynamic", "--wide", library).stdout
            self.assertEqual(
                re.findall(r"R(?:UN)?PATH\).*\[(.*)\]", text), ["$ORIGIN"], library.name
            )
            self.assertEqual(re.findall(r"SONAME\).*\[(.*)\]", text), [library.name])
            for needed in re.findall(r"NEEDED\).*\[(.*)\]", text):
                system = re.match(r"(ld-linux.*|libc|libm|libstdc\+\+|libgcc_s)\.so", needed)
                self.assertTrue(needed in present or system, f"{library.name}: {needed}")

    def test_nothing_tells_where_it_was_built(self):
        for path in self.addon.rglob("*"):
            if path.is_file():
                self.assertNotIn(str(ROOT).encode(), path.read_bytes(), path.name)

    def test_only_our_functions_are_exported(self):
        ours = self.addon / "native" / "lib" / "libexemplar.so"
        text = run("nm", "--dynamic", "--defined-only", ours).stdout
        self.assertTrue(text)
        strange = [line for line in text.splitlines() if not line.split()[-1].startswith("exm_")]
        self.assertEqual(strange, [])

    def test_every_library_has_its_licence(self):
        text = (self.addon / "THIRD_PARTY.md").read_text()
        rows = dict(re.findall(r"\| `(.+?)` \| .*\]\((.+?)\) \|", text))
        self.assertEqual(set(rows), {p.name for p in self.libraries} - {"libexemplar.so"})
        for notice in rows.values():
            self.assertGreater((self.addon / notice).stat().st_size, 300)
        # Texts that the notices only point to.
        for notice in (self.addon / "licences").iterdir():
            pointed = re.findall(r"common-licenses/([A-Z]+-[0-9.]*[0-9])", notice.read_text())
            for licence in pointed:
                self.assertTrue((self.addon / "licences" / f"{licence}.txt").is_file(), licence)

    def test_blender_finds_it_valid(self):
        if blender_version() < (4, 2):
            self.skipTest("This Blender has no extensions to validate")
        done = run(BLENDER, "--command", "extension", "validate", self.path)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)


def blender_version():
    text = run(BLENDER, "--version").stdout
    return tuple(int(part) for part in re.search(r"Blender (\d+)\.(\d+)", text).groups())


class Installed(unittest.TestCase):
    """In a clean profile, where the source, the build and the system's copies are out of sight."""

    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = Path(folder.name)
        cls.env = cls.clean_environment()
        package = make_zip(build_folder())
        # Copies, for the source is hidden later.
        for source in (
            HERE / "use_addon.py",
            ROOT / "tests" / "blender" / "bake_support.py",
            package,
        ):
            shutil.copy(source, cls.folder)
        cls.package = cls.folder / package.name
        cls.said = cls.call("install", cls.package, hide=False)
        cls.addon = Path(cls.said["folder"])

    @classmethod
    def clean_environment(cls):
        left_out = ("LD_LIBRARY_PATH", "LD_PRELOAD", "EXEMPLAR_", "BLENDER", "PYTHONPATH")
        env = {k: v for k, v in os.environ.items() if not k.startswith(left_out)}
        for name in ("SCRIPTS", "CONFIG", "DATAFILES", "EXTENSIONS", "RESOURCES"):
            path = cls.folder / "profile" / name.lower()
            path.mkdir(parents=True)
            env[f"BLENDER_USER_{name}"] = str(path)
        env["HOME"] = str(cls.folder)
        return env

    @classmethod
    def blender(cls, *arguments, hide=True):
        prefix = hiding(cls.folder) if hide else ()
        return run(*prefix, BLENDER, "-b", *arguments, env=cls.env, cwd=cls.folder)

    @classmethod
    def call(cls, what, *arguments, hide=True):
        """What use_addon.py has to say, in a Blender of its own."""
        script = cls.folder / "use_addon.py"
        done = cls.blender("--python", script, "--", what, *arguments, hide=hide)
        lines = [line for line in done.stdout.splitlines() if line.startswith("RESULT ")]
        if not lines:
            raise AssertionError(done.stdout + done.stderr)
        return json.loads(lines[-1].removeprefix("RESULT "))

    def test_installed_inside_the_profile(self):
        self.assertIn(self.folder / "profile", self.addon.parents)
        self.assertIn(self.said["module"].rpartition(".")[2], ("exemplar",))

    def test_bind_solve_bake(self):
        said = self.call("use", self.folder / "used.blend", self.folder / "used.pc2")
        self.assertLess(said["difference"], 1e-6)
        self.assertGreater(said["moved"], 0.1)
        self.check_libraries(said["loaded"])

    def check_libraries(self, loaded):
        inside = self.addon / "native" / "lib"
        bundled = {path.name for path in inside.iterdir()}
        ours = {Path(path) for path in loaded if Path(path).name in bundled}
        self.assertEqual({path.parent for path in ours}, {inside})
        self.assertEqual({path.name for path in ours}, bundled, "bundled, and not loaded")
        # Under its own name nothing of them may have come in, but for what Blender had before.
        own = run("ldd", shutil.which(BLENDER)).stdout
        strangers = [
            path
            for path in loaded
            if Path(path).name.split(".so")[0] + ".so" not in own
            and re.match(
                r"lib(OpenMesh|cholmod|metis|amd|camd|colamd|ccolamd|suitesp)", Path(path).name
            )
            and Path(path).parent != inside
        ]
        self.assertEqual(strangers, [])

    def test_command_line_from_the_installed_folder(self):
        blend, out = self.folder / "line.blend", self.folder / "line.pc2"
        self.call("use", blend, self.folder / "other.pc2")
        done = self.blender(
            blend, "--python", self.addon / "command_line.py", "--",
            "bake", "--object", "Bar", "--out", out,
        )  # fmt: skip
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertEqual(out.read_bytes(), (self.folder / "other.pc2").read_bytes())

    def test_command_line_where_it_is_not_enabled(self):
        blend, out = self.folder / "off.blend", self.folder / "off.pc2"
        self.call("use", blend, self.folder / "off-other.pc2")
        done = self.blender(
            "--factory-startup", blend, "--python", self.addon / "command_line.py", "--",
            "bake", "--object", "Bar", "--out", out,
        )  # fmt: skip
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertEqual(out.read_bytes(), (self.folder / "off-other.pc2").read_bytes())

    def test_installed_again_over_itself(self):
        said = self.call("install", self.package, hide=False)
        self.assertEqual(said["folder"], str(self.addon))
        self.test_bind_solve_bake()


def hiding(folder):
    """A command that runs another where neither this source tree nor the system's copies of what we
    bundle can be seen; nothing where that is not allowed."""
    masked = " && ".join(f"mount --bind /dev/null '{path}'" for path in hidden_libraries())
    script = f"mount -t tmpfs none '{ROOT}' && {masked or 'true'}"
    if run("unshare", "-rm", "sh", "-c", script).returncode:
        return ()
    return ("unshare", "-rm", "sh", "-c", f'{script} && cd "{folder}" && exec "$@"', "sh")


def hidden_libraries():
    """Files of the system that the bundle was made from, and that Blender itself can do without."""
    blender = shutil.which(BLENDER)
    own = run("ldd", blender).stdout if blender else ""
    names = (
        "OpenMeshCore",
        "cholmod",
        "metis",
        "amd",
        "camd",
        "colamd",
        "ccolamd",
        "suitesparseconfig",
    )
    names += ("lapacke", "tmglib")
    found = set()
    for name in names:
        for path in Path("/usr/lib").glob(f"*-linux-gnu*/lib{name}.so*"):
            if f"lib{name}.so" not in own:
                found.add(path.resolve())
    return sorted(found)


if __name__ == "__main__":
    support.run(globals())
