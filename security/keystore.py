"""
Make a keystore from a policy where `ros2 security` is not installed: Python and openssl 3 will do.

    python security/keystore.py POLICY.xml KEYSTORE [--domain N]

The layout is that of `ros2 security create_keystore`, so ROS_SECURITY_KEYSTORE may name it. Keys
that are there are kept; permissions are written and signed anew.
"""

import argparse
from collections.abc import Iterator
import datetime
from pathlib import Path
import subprocess
import xml.etree.ElementTree as ET

DAYS = 3650
SPECIFICATION = 'http://www.omg.org/spec/DDS-SECURITY/20170901/omg_shared_ca_'

# What each right on an expression of a policy means in topics of DDS, %s the full name: those
# published, those subscribed to. (Design of ROS 2: topic and service names, access control.)
_ACTION = ('cancel_goal', 'get_result', 'send_goal')
_REQUESTS = tuple(f'rq%s/_action/{part}Request' for part in _ACTION)
_REPLIES = tuple(f'rr%s/_action/{part}Reply' for part in _ACTION)
_NEWS = ('rt%s/_action/feedback', 'rt%s/_action/status')
RIGHTS: dict[tuple[str, str], tuple[tuple[str, ...], tuple[str, ...]]] = {
    ('topics', 'publish'): (('rt%s',), ()),
    ('topics', 'subscribe'): ((), ('rt%s',)),
    ('services', 'request'): (('rq%sRequest',), ('rr%sReply',)),
    ('services', 'reply'): (('rr%sReply',), ('rq%sRequest',)),
    ('actions', 'call'): (_REQUESTS, (*_REPLIES, *_NEWS)),
    ('actions', 'execute'): ((*_REPLIES, *_NEWS), _REQUESTS),
}

# Every participant tells the others which nodes it holds.
DISCOVERY = 'ros_discovery_info'

GOVERNANCE = f"""<?xml version="1.0" encoding="UTF-8"?>
<dds xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance"
    xsi:noNamespaceSchemaLocation="{SPECIFICATION}governance.xsd">
  <domain_access_rules>
    <domain_rule>
      <domains><id>%d</id></domains>
      <allow_unauthenticated_participants>false</allow_unauthenticated_participants>
      <enable_join_access_control>true</enable_join_access_control>
      <discovery_protection_kind>ENCRYPT</discovery_protection_kind>
      <liveliness_protection_kind>ENCRYPT</liveliness_protection_kind>
      <rtps_protection_kind>ENCRYPT</rtps_protection_kind>
      <topic_access_rules>
        <topic_rule>
          <topic_expression>*</topic_expression>
          <enable_discovery_protection>true</enable_discovery_protection>
          <enable_liveliness_protection>true</enable_liveliness_protection>
          <enable_read_access_control>true</enable_read_access_control>
          <enable_write_access_control>true</enable_write_access_control>
          <metadata_protection_kind>ENCRYPT</metadata_protection_kind>
          <data_protection_kind>ENCRYPT</data_protection_kind>
        </topic_rule>
      </topic_access_rules>
    </domain_rule>
  </domain_access_rules>
</dds>
"""


def topics(enclave: ET.Element) -> tuple[set[str], set[str]]:
    """
    Return the DDS topics that an enclave of a policy may publish, and those it may subscribe to.

    :raises ValueError: for a rule that this does not know, DENY included: what is not allowed is
        denied.
    """
    publish, subscribe = {DISCOVERY}, {DISCOVERY}
    for profile in enclave.iterfind('profiles/profile'):
        for rules in profile:
            for right, value in rules.attrib.items():
                if value != 'ALLOW' or (rules.tag, right) not in RIGHTS:
                    raise ValueError(f'{enclave.get("path")}: {rules.tag} {right}={value!r}')
                out, into = RIGHTS[rules.tag, right]
                for name in names(profile, rules):
                    publish.update(form % name for form in out)
                    subscribe.update(form % name for form in into)
    return publish, subscribe


def names(profile: ET.Element, rules: ET.Element) -> Iterator[str]:
    """Yield the full names of a list of expressions."""
    namespace = profile.attrib['ns'].rstrip('/') + '/'
    for expression in rules:
        name = (expression.text or '').strip()
        if name.startswith('~/'):
            name = namespace + profile.attrib['node'] + name[1:]
        elif not name.startswith('/'):
            name = namespace + name
        if '*' in name or '?' in name:
            raise ValueError(f'{name!r}: name what is allowed, one by one')
        yield name


def permissions(enclave: ET.Element, domain: int) -> str:
    """Return the permissions of an enclave as the DDS security plugins read them."""
    now = datetime.datetime.now(datetime.timezone.utc).replace(microsecond=0)
    path = enclave.attrib['path']
    dds = ET.Element('dds')
    grant = ET.SubElement(ET.SubElement(dds, 'permissions'), 'grant', name=path)
    ET.SubElement(grant, 'subject_name').text = f'CN={path}'
    validity = ET.SubElement(grant, 'validity')
    for tag, when in (('not_before', now), ('not_after', now + datetime.timedelta(days=DAYS))):
        ET.SubElement(validity, tag).text = when.strftime('%Y-%m-%dT%H:%M:%SZ')
    rule = ET.SubElement(grant, 'allow_rule')
    ET.SubElement(ET.SubElement(rule, 'domains'), 'id').text = str(domain)
    for tag, allowed in zip(('publish', 'subscribe'), topics(enclave), strict=True):
        listed = ET.SubElement(ET.SubElement(rule, tag), 'topics')
        for topic in sorted(allowed):
            ET.SubElement(listed, 'topic').text = topic
    ET.SubElement(grant, 'default').text = 'DENY'
    ET.indent(dds)
    return ET.tostring(dds, encoding='unicode', xml_declaration=True) + '\n'


def openssl(*arguments: str | Path) -> None:
    """Run openssl; what it says appears only if it fails."""
    done = subprocess.run(['openssl', *arguments], capture_output=True, text=True, check=False)
    if done.returncode:
        raise SystemExit(f'openssl {arguments[0]}: {done.stderr}')


def certificate(name: str, folder: Path, stem: str, ca: tuple[Path, Path] | None) -> None:
    """Make a key and a certificate of a name, signed by itself or by an authority."""
    cert, key = folder / f'{stem}cert.pem', folder / f'{stem}key.pem'
    if cert.exists() and key.exists():
        return
    openssl('ecparam', '-name', 'prime256v1', '-genkey', '-noout', '-out', key)
    key.chmod(0o600)
    extension = f'basicConstraints=critical,CA:{"FALSE" if ca else "TRUE,pathlen:1"}'
    signed = ('-CA', ca[0], '-CAkey', ca[1]) if ca else ()
    # The slashes of the name are part of it.
    subject = '/CN=' + name.replace('/', '\\/')
    openssl(
        *('req', '-x509', '-new', '-sha256', '-days', str(DAYS), '-key', key, '-out', cert),
        *('-subj', subject, '-addext', extension, *signed),
    )


def sign(text: str, file: Path, ca: tuple[Path, Path]) -> None:
    """Write a text, and beside it the same signed by an authority."""
    source = file.with_suffix('.xml')
    source.write_text(text)
    openssl(
        *('smime', '-sign', '-text', '-md', 'sha256', '-in', source, '-out', file),
        *('-signer', ca[0], '-inkey', ca[1]),
    )


def make(policy: Path, keystore: Path, domain: int) -> None:
    """Make or renew a keystore."""
    public, private, enclaves = (keystore / name for name in ('public', 'private', 'enclaves'))
    for folder in (public, private, enclaves):
        folder.mkdir(parents=True, exist_ok=True)
    private.chmod(0o700)
    certificate('sros2CA', private, 'ca.', None)
    ca = (private / 'ca.cert.pem', private / 'ca.key.pem')
    for name in ('identity_ca', 'permissions_ca'):
        (public / f'{name}.cert.pem').write_bytes(ca[0].read_bytes())
    sign(GOVERNANCE % domain, enclaves / 'governance.p7s', ca)
    for enclave in ET.parse(policy).getroot().iterfind('enclaves/enclave'):
        path = enclave.attrib['path']
        folder = enclaves / path.lstrip('/')
        folder.mkdir(parents=True, exist_ok=True)
        for name in ('identity_ca', 'permissions_ca'):
            (folder / f'{name}.cert.pem').write_bytes(ca[0].read_bytes())
        (folder / 'governance.p7s').write_bytes((enclaves / 'governance.p7s').read_bytes())
        certificate(path, folder, '', ca)
        sign(permissions(enclave, domain), folder / 'permissions.p7s', ca)


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('policy', type=Path)
    parser.add_argument('keystore', type=Path)
    parser.add_argument('--domain', type=int, default=0, help='ROS_DOMAIN_ID (0)')
    arguments = parser.parse_args()
    make(arguments.policy, arguments.keystore, arguments.domain)


if __name__ == '__main__':
    main()
