#!/usr/bin/env bash
# Validates certificates of `errsep export dcc` against DCC 3.2.1 and every D-SI schema that is at hand.
#
#     ERRSEP_DCC_SCHEMA=FOLDER examples/dcc/validate.sh CERTIFICATE.xml…
#
# FOLDER holds dcc*.xsd (3.2.1), one or more SI_Format*.xsd (2.1.0 is what DCC 3.2.1 imports; 2.2 is valid too) with
# quantityKind.xsd where it is imported, and xmldsig-core-schema.xsd. Where the latter is absent a stub stands in that
# declares ds:Signature with any content; errsep signs nothing. The imports are turned to the local copies in a
# folder that is removed at the end. Needs xmllint (libxml2).
set -euo pipefail

if [ -z "${ERRSEP_DCC_SCHEMA:-}" ]; then
    echo "skipped: ERRSEP_DCC_SCHEMA names no folder with the schemas"
    exit 0
fi
if ! command -v xmllint > /dev/null; then
    echo "skipped: xmllint is not there"
    exit 0
fi
shopt -s nullglob
dcc=("$ERRSEP_DCC_SCHEMA"/dcc*.xsd)
units=("$ERRSEP_DCC_SCHEMA"/SI_Format*.xsd)
if [ ${#dcc[@]} -ne 1 ] || [ ${#units[@]} -eq 0 ]; then
    echo "$ERRSEP_DCC_SCHEMA must hold one dcc*.xsd and at least one SI_Format*.xsd" >&2
    exit 2
fi
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

sed -e 's#schemaLocation="[^"]*SI_Format\.xsd"#schemaLocation="SI_Format.xsd"#' \
    -e 's#schemaLocation="[^"]*xmldsig-core-schema\.xsd"#schemaLocation="xmldsig-core-schema.xsd"#' \
    "${dcc[0]}" > "$work/dcc.xsd"
if [ -e "$ERRSEP_DCC_SCHEMA/xmldsig-core-schema.xsd" ]; then
    # Its document type is fetched from the network by some readers, and declares nothing that is used.
    sed '/<!DOCTYPE/,/\]>/d' "$ERRSEP_DCC_SCHEMA/xmldsig-core-schema.xsd" > "$work/xmldsig-core-schema.xsd"
else
    echo "a stub stands in for xmldsig-core-schema.xsd"
    cat > "$work/xmldsig-core-schema.xsd" << 'STUB'
<xs:schema xmlns:xs="http://www.w3.org/2001/XMLSchema" targetNamespace="http://www.w3.org/2000/09/xmldsig#">
  <xs:element name="Signature" type="xs:anyType"/>
</xs:schema>
STUB
fi
for kinds in "$ERRSEP_DCC_SCHEMA"/quantity[Kk]ind.xsd; do
    # The type is imported as quantitykind; some copies declare quantityKind.
    sed 's/name="quantityKind"/name="quantitykind"/' "$kinds" > "$work/quantitykind.xsd"
done

failed=0
for unit in "${units[@]}"; do
    sed 's#schemaLocation="[^"]*quantity[Kk]ind\.xsd"#schemaLocation="quantitykind.xsd"#' "$unit" > "$work/SI_Format.xsd"
    for certificate in "$@"; do
        if told=$(xmllint --nonet --noout --schema "$work/dcc.xsd" "$certificate" 2>&1); then
            echo "valid: $certificate with $(basename "$unit")"
        else
            echo "not valid: $certificate with $(basename "$unit")"
            echo "$told"
            failed=1
        fi
    done
done
exit $failed
