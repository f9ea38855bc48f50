"""Promise: the chart renders what Kubernetes accepts, whatever its values, and the pod that it describes serves."""

import copy
import functools
import importlib
import itertools
import json
import os
import subprocess
import sys
import sysconfig
import tomllib
import types
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import kubernetes_validate
import pytest
import yaml
from cloudcoil.models.prometheus_operator.v1 import ServiceMonitor

ROOT = Path(__file__).resolve().parents[2]
CHART = ROOT / "deploy" / "chart"
HELM = os.environ["WADE_HELM"]
WADE = Path(os.environ.get("WADE_BIN", ROOT / "target" / "debug" / "wade")).resolve()
# the oldest that Chart.yaml allows and the newest that the schemas know
VERSIONS = ["1.30", kubernetes_validate.latest_version().rsplit(".", 1)[0]]
SIDECAR = {"name": "simulator", "image": "simulator:1", "securityContext": {"capabilities": {"add": ["SYS_NICE"]}}}

# Each value or group of values with all that it can be; a combination takes one of each.
CHOICES = {
    "security": [
        {"insecure": True},
        {"tls": {"secret": "wade-tls"}},
        {"tls": {"secret": "wade-tls"}, "access": {"tokensSecret": "wade-tokens"}},
        {
            "tls": {"secret": "wade-tls", "clientCa": True},
            "access": {"tokensSecret": "wade-tokens", "certificates": {"rig.lab": ["query"], "*": ["observe"]}},
        },
    ],
    "memory": [
        {},
        {"sidecars": [SIDECAR]},
        {"sidecars": [SIDECAR, {**SIDECAR, "name": "logger"}], "sharedMemory": {"wait": "block", "size": "1Gi"}},
        {"sidecars": [SIDECAR], "sharedMemory": {"wait": "spin"}},
    ],
    "monitor": [
        {},
        {
            "serviceMonitor": {
                "enabled": True,
                "labels": {"release": "prometheus"},
                "serverName": "wade.lab",
                "tokenSecret": "observer",
            }
        },
    ],
    "network": [
        {"networkPolicy": {"enabled": False}},
        {},
        {"networkPolicy": {"clients": [], "observers": [], "egress": [{"ports": [{"port": 4317}]}]}},
    ],
    "budget": [{}, {"disruptionBudget": {"enabled": False}}, {"disruptionBudget": {"maxUnavailable": "50%"}}],
    "service": [{}, {"service": {"type": "LoadBalancer", "headless": True, "annotations": {"a/b": "c"}}}],
    "vehicles": [{}, {"vehicles": {"claim": "bundles"}}],
    "settings": [{}, {"settings": "drain_s = 3.0\n\n[grpc]\nmax_batch = 128\n"}],
    "place": [
        {},
        {
            "image": {"repository": "registry.lab/wade", "tag": "x", "pullPolicy": "Always"},
            "imagePullSecrets": [{"name": "registry"}],
            "replicas": 1,
            "resources": {},
            "nodeSelector": {"disk": "ssd"},
            "tolerations": [{"key": "robots", "operator": "Exists"}],
            "affinity": {"podAntiAffinity": {}},
            "podAnnotations": {"a": "b"},
        },
    ],
}


def combinations():
    """Every pair of choices beside the first of the others, and every combination of what decides about security,
    memory, the monitor, the network and the budget: those share templates."""
    entangled = ["security", "memory", "monitor", "network", "budget"]
    apart = [name for name in CHOICES if name not in entangled]
    for chosen in itertools.product(*(CHOICES[name] for name in entangled)):
        yield chosen
    for first in CHOICES["security"]:
        for second in CHOICES["memory"]:
            for others in itertools.product(*(CHOICES[name] for name in apart)):
                yield (first, second, *others)


def merged(parts):
    values = {}
    for part in parts:
        values.update(copy.deepcopy(part))
    return values


def helm(verb, values, release="rig"):
    arguments = [HELM, verb, *([release] if verb == "template" else []), str(CHART), "--values", "-"]
    return subprocess.run(arguments, input=json.dumps(values), capture_output=True, text=True, timeout=60)


def rendered(values, release="rig"):
    done = helm("template", values, release)
    assert done.returncode == 0, f"{values}: {done.stderr}"
    return [document for document in yaml.safe_load_all(done.stdout) if document]


def of(documents, kind):
    return [document for document in documents if document["kind"] == kind]


@functools.cache
def accepted(text):
    """Whether the schemas accept a document; one that was seen before is not looked at again."""
    document = json.loads(text)
    if document["kind"] == "ServiceMonitor":
        # the model drops what it does not know
        known = ServiceMonitor.model_validate(document).model_dump(mode="json", by_alias=True, exclude_unset=True)
        assert known == document
        return
    for version in VERSIONS:
        kubernetes_validate.validate(document, version, strict=True)


def check(values):
    documents = rendered(values)
    for document in documents:
        accepted(json.dumps(document, sort_keys=True))
    names = [(document["kind"], document["metadata"]["name"]) for document in documents]
    assert len(names) == len(set(names))

    def wanted(part):
        return values.get(part, {}).get("enabled", part != "serviceMonitor")

    assert len(of(documents, "PodDisruptionBudget")) == wanted("disruptionBudget")
    assert len(of(documents, "NetworkPolicy")) == wanted("networkPolicy")
    assert len(of(documents, "ServiceMonitor")) == wanted("serviceMonitor")

    (deployment,) = of(documents, "Deployment")
    template = deployment["spec"]["template"]
    labels, pod = template["metadata"]["labels"], template["spec"]
    # whatever selects pods selects these
    selectors = [deployment["spec"]["selector"]["matchLabels"]]
    selectors += [service["spec"]["selector"] for service in of(documents, "Service")]
    selectors += [budget["spec"]["selector"]["matchLabels"] for budget in of(documents, "PodDisruptionBudget")]
    selectors += [policy["spec"]["podSelector"]["matchLabels"] for policy in of(documents, "NetworkPolicy")]
    for selector in selectors:
        assert selector.items() <= labels.items()

    assert pod["securityContext"]["runAsNonRoot"] and pod["securityContext"]["runAsUser"] > 0
    ports = {port["name"] for port in pod["containers"][0]["ports"]}
    for service in of(documents, "Service"):
        assert {port["targetPort"] for port in service["spec"]["ports"]} <= ports
    volumes = [volume["name"] for volume in pod["volumes"]]
    assert len(volumes) == len(set(volumes))
    for container in pod["containers"]:
        confined = container["securityContext"]
        assert confined["readOnlyRootFilesystem"] and not confined["allowPrivilegeEscalation"]
        assert confined["capabilities"]["drop"] == ["ALL"]
        assert {mount["name"] for mount in container["volumeMounts"]} <= set(volumes)
    server = pod["containers"][0]
    for probe in ["startupProbe", "livenessProbe", "readinessProbe"]:
        assert server[probe]["httpGet"]["port"] in ports
        assert (server[probe]["httpGet"]["scheme"] == "HTTPS") == ("tls" in values)

    (config,) = of(documents, "ConfigMap")
    settings = tomllib.loads(config["data"]["wade.toml"])
    assert ("certificate" in settings.get("tls", {})) == ("tls" in values)
    assert ("--insecure" in server["args"]) == values.get("insecure", False)
    assert (settings.get("drain_s") == 3.0) == ("settings" in values)
    # the wait before the end and the drain fit into what the cluster grants
    waits = server["lifecycle"]["preStop"]["sleep"]["seconds"] + settings.get("drain_s", 5.0)
    assert pod["terminationGracePeriodSeconds"] > waits


def test_every_combination_is_accepted():
    every = [merged(parts) for parts in combinations()]
    with ThreadPoolExecutor(2) as pool:
        list(pool.map(check, every))
    print(f"{len(every)} combinations")


def test_lint_has_nothing_against_each_choice():
    base = {"insecure": True}
    for name, choices in CHOICES.items():
        for choice in choices:
            done = helm("lint", choice if name == "security" else {**base, **choice})
            assert done.returncode == 0 and "[WARNING]" not in done.stdout, f"{choice}: {done.stdout}{done.stderr}"


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({}, "tls.secret is empty"),
        ({"insecure": True, "tls": {"secret": "a"}}, "contradict each other"),
        ({"insecure": True, "tls": {"clientCa": True}}, "tls.clientCa needs tls.secret"),
        ({"insecure": True, "access": {"tokensSecret": "a"}}, "access.tokensSecret needs tls.secret"),
        ({"tls": {"secret": "a"}, "access": {"certificates": {"*": ["query"]}}}, "needs tls.clientCa"),
        ({"insecure": True, "settings": "[tls]\nkey = 1"}, "settings may not hold [tls]"),
        ({"insecure": True, "sharedMemory": {"wait": "block"}}, "sidecars is empty"),
        ({"insecure": True, "settings": "drain_s = 2 s"}, "settings is no TOML"),
        ({"insecure": True, "gracePeriodSeconds": 8}, "gracePeriodSeconds"),
        ({"insecure": True, "replica": 3}, "'replica' not allowed"),
        ({"insecure": True, "sharedMemory": {"wait": "poll"}}, "/sharedMemory/wait"),
        ({"insecure": True, "user": 0}, "/user"),
    ],
)
def test_what_cannot_be_is_refused_by_name(values, said):
    done = helm("template", values)
    assert done.returncode != 0 and said in done.stderr, done.stderr


def test_names_are_those_of_kubernetes_for_any_release():
    for release in ["w", "wade", "a" * 53]:
        documents = rendered({"insecure": True, "service": {"headless": True}}, release)
        for document in documents:
            name = document["metadata"]["name"]
            assert len(name) <= 63 and "wade" in name and not name.endswith("-"), name


def test_the_chart_has_the_version_of_the_program():
    chart = yaml.safe_load((CHART / "Chart.yaml").read_text())
    version = tomllib.loads((ROOT / "Cargo.toml").read_text())["workspace"]["package"]["version"]
    assert chart["version"] == chart["appVersion"] == version
    image = yaml.safe_load((ROOT / "deploy" / "kserve.yaml").read_text().split("---")[0])["spec"]["containers"][0]
    assert image["image"] == f"wade:{version}"


# a new network has its loopback down
LOOPBACK = """python3 - <<'PY'
import fcntl, socket, struct
SIOCSIFFLAGS, IFF_UP = 0x8914, 1
fcntl.ioctl(socket.socket(), SIOCSIFFLAGS, struct.pack("16sh", b"lo", IFF_UP))
PY"""

# The pod as a node would run it: namespaces of its own, a root that cannot be written, a user without rights, and the
# volumes of the rendered deployment. What a cluster would do beyond that (images, networks, probes by the kubelet) is not in it.
POD = r"""
set -euo pipefail
work=$1 user=$2
mount --make-rprivate /
mount -t tmpfs layers "$work/layers"
mkdir "$work/layers/upper" "$work/layers/work" "$work/layers/root"
root=$work/layers/root
mount -t overlay overlay -o "lowerdir=/,upperdir=$work/layers/upper,workdir=$work/layers/work" "$root"
mkdir -p "$root/etc/wade" "$root/run/wade" "$root/tmp/iceoryx2" "$root/vehicles" "$root/mnt/models"
: > "$root/usr/local/bin/wade"
mount --bind "$3" "$root/usr/local/bin/wade"
mount -t proc proc "$root/proc"
mount --rbind /dev "$root/dev"
cp -r "$work/etc/." "$root/etc/wade/"
chgrp -R "$user" "$root/etc/wade"
while read -r path size; do mount -t tmpfs -o "mode=0777,size=$size" volume "$root$path"; done < "$work/volumes"
mount -o remount,ro "$root"
inside() { exec chroot "$root" setpriv --reuid "$user" --regid "$user" --clear-groups --no-new-privs --bounding-set=-all \
    env -i PATH=/usr/local/bin:/usr/bin:/bin HOME=/ "$@"; }
inside /usr/local/bin/wade $(cat "$work/arguments") > "$work/log" 2>&1 &
server=$!
for _ in $(seq 600); do
    ! grep -q 'ready in' "$work/log" || break
    kill -0 $server || { cat "$work/log"; exit 1; }
    sleep 0.1
done
(inside bash -c "$4") || { cat "$work/log"; exit 1; }
kill $server
wait $server
"""


def certificate(folder):
    """A certificate for localhost under an authority of its own, as cert-manager would leave them in a secret."""
    folder.mkdir(parents=True)

    def openssl(*arguments):
        subprocess.run(["openssl", *arguments], cwd=folder, check=True, capture_output=True, timeout=60)

    key = ["-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes", "-days", "1"]
    openssl("req", "-x509", *key, "-keyout", "ca.key", "-out", "ca.crt", "-subj", "/CN=authority")
    openssl("req", "-x509", *key, "-keyout", "tls.key", "-out", "tls.crt", "-subj", "/CN=localhost",
            "-CA", "ca.crt", "-CAkey", "ca.key", "-addext", "basicConstraints=critical,CA:FALSE",
            "-addext", "subjectAltName=DNS:localhost")  # fmt: skip
    (folder / "ca.key").unlink()
    (folder / "tls.key").chmod(0o640)


def lived(tmp_path, values, asks):
    """What the pod of these values printed to a container beside the server that runs `asks`."""
    documents = rendered(values)
    pod = of(documents, "Deployment")[0]["spec"]["template"]["spec"]
    server = pod["containers"][0]
    (tmp_path / "layers").mkdir()
    (tmp_path / "etc").mkdir()
    (tmp_path / "etc" / "wade.toml").write_text(of(documents, "ConfigMap")[0]["data"]["wade.toml"])
    if any(mount["name"] == "tls" for mount in server["volumeMounts"]):
        certificate(tmp_path / "etc" / "tls")
    sizes = {volume["name"]: volume["emptyDir"]["sizeLimit"] for volume in pod["volumes"] if "emptyDir" in volume}
    mounts = [mount for mount in server["volumeMounts"] if mount["name"] in sizes]
    if "sidecars" in values:
        assert mounts == pod["containers"][1]["volumeMounts"]
    (tmp_path / "volumes").write_text(
        "".join(f"{m['mountPath']} {sizes[m['name']].removesuffix('i')}\n" for m in mounts)
    )
    (tmp_path / "arguments").write_text(" ".join(server["args"]))
    user = str(pod["securityContext"]["runAsUser"])
    # a network of its own: the ports are those of the chart
    alone = ["unshare", "--mount", "--pid", "--net", "--ipc", "--fork", "--kill-child", "--mount-proc"]
    start = f"{LOOPBACK}\n{POD}"
    arguments = [*alone, "bash", "-c", start, "pod", str(tmp_path), user, str(WADE), f"set -euo pipefail\n{asks}"]
    done = subprocess.run(arguments, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_the_pod_serves_without_rights_and_with_a_root_that_cannot_be_written(tmp_path):
    printed = lived(
        tmp_path,
        {"insecure": True, "sidecars": [SIDECAR], "sharedMemory": {"wait": "block"}},
        """
        ! touch /written 2> /dev/null
        for probe in livez readyz metrics; do curl --fail --silent --show-error http://127.0.0.1:9464/$probe; done
        for address in http://127.0.0.1:50051 unix:/run/wade/wade.sock; do
            wade query --vehicle husky --speed 0.8 --depth 0.18 --addr $address | grep 'net force'
        done
        wade query --vehicle husky --speed 0.8 --depth 0.18 --transport shm | grep 'net force'
        """,
    )
    answers = [line for line in printed.splitlines() if "net force" in line]
    assert len(answers) == 3 and len(set(answers)) == 1, printed
    assert 'wade_bundle_version{vehicle="husky"' in printed


def test_the_pod_serves_with_a_certificate(tmp_path):
    lived(
        tmp_path,
        {"tls": {"secret": "wade-tls"}, "settings": "[grpc]\nmax_batch = 128\n"},
        """
        # as the kubelet asks: it does not look at the name
        for probe in livez readyz; do curl --fail --silent --insecure https://127.0.0.1:9464/$probe; done
        wade query --vehicle husky --speed 0.8 --depth 0.18 --addr https://localhost:50051 --ca /etc/wade/tls/ca.crt
        ! wade query --vehicle husky --speed 0.8 --depth 0.18 --addr http://127.0.0.1:50051 2> /dev/null
        """,
    )


def models():
    """Lets KServe's models be imported without the server that the rest of its package is."""
    folder = Path(sysconfig.get_paths()["purelib"]) / "kserve"
    for name, path in [("kserve", folder), ("kserve.models", folder / "models")]:
        package = types.ModuleType(name)
        package.__path__ = [str(path)]
        sys.modules[name] = package


def snake(name):
    return "".join(f"_{letter.lower()}" if letter.isupper() else letter for letter in name)[1:]


def knows(model, value, at):
    """Checks a value against one of KServe's models, down to what Kubernetes has a schema for."""
    if model in {"str", "bool", "int"} or model.startswith("dict("):
        assert isinstance(value, {"str": str, "bool": bool, "int": int}.get(model, dict)), at
    elif model.startswith("list["):
        for index, entry in enumerate(value):
            knows(model[5:-1], entry, f"{at}[{index}]")
    elif model == "V1Container":
        pod = {"apiVersion": "v1", "kind": "Pod", "metadata": {"name": "a"}, "spec": {"containers": [value]}}
        for version in VERSIONS:
            kubernetes_validate.validate(pod, version, strict=True)
    else:
        for version in ["V1alpha1", "V1beta1"]:
            if model.startswith(version):
                file = f"{version.lower()}_{snake(model.removeprefix(version))}"
                known = getattr(importlib.import_module(f"kserve.models.{file}"), model)
                names = {json_name: python_name for python_name, json_name in known.attribute_map.items()}
                assert value.keys() <= names.keys(), f"{at}: {value.keys() - names.keys()}"
                known(**{names[key]: entry for key, entry in value.items()})
                for key, entry in value.items():
                    knows(known.openapi_types[names[key]], entry, f"{at}.{key}")
                return
        raise AssertionError(f"{at}: no model {model}")


def test_kserve_knows_every_field_of_the_runtime():
    models()
    runtime, service = yaml.safe_load_all((ROOT / "deploy" / "kserve.yaml").read_text())
    assert (
        runtime["apiVersion"] == "serving.kserve.io/v1alpha1" and service["apiVersion"] == "serving.kserve.io/v1beta1"
    )
    knows("V1alpha1ServingRuntimeSpec", runtime["spec"], "runtime")
    knows("V1beta1InferenceServiceSpec", service["spec"], "service")
    (container,) = runtime["spec"]["containers"]
    assert container["name"] == "kserve-container"
    model = service["spec"]["predictor"]["model"]
    assert model["modelFormat"]["name"] in {entry["name"] for entry in runtime["spec"]["supportedModelFormats"]}
    assert model["protocolVersion"] in runtime["spec"]["protocolVersions"]
    runtime["spec"]["containerz"] = []
    with pytest.raises(AssertionError, match="containerz"):
        knows("V1alpha1ServingRuntimeSpec", runtime["spec"], "runtime")


def test_the_server_starts_as_kserve_starts_it(tmp_path):
    runtime = next(yaml.safe_load_all((ROOT / "deploy" / "kserve.yaml").read_text()))
    here = {"/mnt/models": str(ROOT / "vehicles"), ":50051": ":0", ":9464": ":0"}
    arguments = runtime["spec"]["containers"][0]["args"]
    for there, instead in here.items():
        arguments = [argument.replace(there, instead) for argument in arguments]
    server = subprocess.Popen([WADE, *arguments, "--with-parent"], stderr=subprocess.PIPE, text=True, cwd=tmp_path)
    assert any("ready in" in line for line in server.stderr)
    server.terminate()
    assert server.wait(timeout=60) == 0
